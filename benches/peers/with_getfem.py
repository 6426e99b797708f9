"""Hertz contact of two bodies by GetFEM: with_getfem.py DIRECTORY LIFT0 LIFT1 AXIS0 AXIS1.

Reads body0.mesh and body1.mesh (regions: 1 the flat, 2 the arc); LIFT: displacement of the flats along y; AXIS: y of the node
on x = 0 that keeps x. Writes displacements and von Mises stress, prints the Newton steps and the peak pressure.
"""
import sys

import getfem as gf
import getfem_body as body

FLAT, ARC = 1, 2
SLAVE, MASTER, SYMMETRIC = 1, 0, 2

directory = sys.argv[1]
lifts, axes = [[float(v) for v in sys.argv[i : i + 2]] for i in (2, 4)]
md = body.model()
parts = []
for b in (0, 1):
    u = f"u{b}"
    fem, node, rule = body.elastic(md, u, gf.Mesh("load", f"{directory}/body{b}.mesh"))
    body.lift(md, u, fem, rule, FLAT, lifts[b])
    body.pin(md, u, axes[b])
    parts.append((u, fem, node, rule))
(_, _, node, rule), (_, _, _, other) = parts
md.add_nodal_contact_between_nonmatching_meshes_brick(
    rule, other, "u0", "u1", "force", "r", ARC, ARC, SLAVE, MASTER, SYMMETRIC
)
steps = body.solve(md)
for b, (u, fem, scalar, _) in enumerate(parts):
    body.export(md, u, fem, scalar, f"{directory}/body{b}.vtk")
# Pressure at a node: its force on the length it stands for.
length = body.lengths(rule, node, ARC)[node.basic_dof_on_region(ARC)]
print("steps", steps)
print("peak pressure", max(-md.variable("force") / length))
