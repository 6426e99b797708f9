"""Writes the Gmsh files of this directory. Needs the `gmsh` Python package: pip install gmsh; python make.py

A strip 4 x 1 with a quarter-circle notch (radius 0.5 about the origin), body "plate", below a block 4 x 0.5, body "block".
The bodies do not share nodes; both are on the line y = 1 ("plate top", "block bottom"). "ends" belongs to both.
"""
import gmsh


def model(kind, order):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("strip")
    geo = gmsh.model.geo
    point = [geo.addPoint(x, y, 0) for x, y in [(0, 0), (0.5, 0), (4, 0), (4, 1), (0, 1), (0, 0.5)]]
    arc = geo.addCircleArc(point[5], point[0], point[1])
    bottom, right, top, left = (geo.addLine(point[a], point[b]) for a, b in [(1, 2), (2, 3), (3, 4), (4, 5)])
    plate = geo.addPlaneSurface([geo.addCurveLoop([arc, bottom, right, top, left])])
    upper = [geo.addPoint(x, y, 0) for x, y in [(0, 1), (4, 1), (4, 1.5), (0, 1.5)]]
    side = [geo.addLine(upper[i], upper[(i + 1) % 4]) for i in range(4)]
    block = geo.addPlaneSurface([geo.addCurveLoop(side)])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [plate], 1, "plate")
    gmsh.model.addPhysicalGroup(2, [block], 2, "block")
    gmsh.model.addPhysicalGroup(1, [arc], 10, "notch")
    gmsh.model.addPhysicalGroup(1, [top], 11, "plate top")
    gmsh.model.addPhysicalGroup(1, [side[0]], 12, "block bottom")
    gmsh.model.addPhysicalGroup(1, [right, side[1]], 13, "ends")
    gmsh.model.addPhysicalGroup(1, [bottom], 14)
    for option, value in [("MeshSizeMin", 0.4), ("MeshSizeMax", 0.4), ("SecondOrderIncomplete", 1), ("Algorithm", 8)]:
        gmsh.option.setNumber("Mesh." + option, value)
    if kind == "quad":
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 2)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)


def save(name, version, binary):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(name)


for kind in ["tri", "quad"]:
    for order in [1, 2]:
        model(kind, order)
        for version in [2.2, 4.1]:
            for binary in [0, 1]:
                save(f"{kind}{order}-{version}-{'binary' if binary else 'ascii'}.msh", version, binary)
        if (kind, order) == ("quad", 2):
            gmsh.model.mesh.setOrder(1)
            gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 0)
            gmsh.model.mesh.setOrder(2)
            save("quad9.msh", 4.1, 0)
        gmsh.finalize()

# A solid, to be refused.
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMin", 2)
gmsh.model.mesh.generate(3)
save("solid.msh", 4.1, 0)
gmsh.finalize()
