"""Writes the Gmsh 2.2 files of distorted/ and bad-input/: python3 meshes.py. Standard library only."""
import math
import pathlib

HERE = pathlib.Path(__file__).parent
KIND = {("tri", 1): 2, ("quad", 1): 3, ("tri", 2): 9, ("quad", 2): 16}


def grid(x, y):
    """Nodes (x, y) of a grid, x fastest, and its quadrilaterals."""
    nodes = [(a, b) for b in y for a in x]
    n = len(x)
    quads = [[j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i] for j in range(len(y) - 1) for i in range(n - 1)]
    return nodes, quads


def lines(n, m):
    """Surfaces of a grid of n x m nodes: lists of node pairs."""
    row = lambda j: [(j * n + i, j * n + i + 1) for i in range(n - 1)]
    column = lambda i: [(j * n + i, (j + 1) * n + i) for j in range(m - 1)]
    return {"bottom": row(0), "top": row(m - 1), "left": column(0), "right": column(n - 1)}


def triangles(quads):
    """Each quadrilateral in two, the diagonals alternating."""
    cells = []
    for k, (a, b, c, d) in enumerate(quads):
        cells += [[a, b, c], [a, c, d]] if k % 2 else [[a, b, d], [b, c, d]]
    return cells


def second_order(nodes, cells, surfaces):
    """Straight sides with nodes in their middle."""
    nodes, middle = list(nodes), {}

    def mid(a, b):
        key = (min(a, b), max(a, b))
        if key not in middle:
            middle[key] = len(nodes)
            nodes.append(tuple(0.5 * (p + q) for p, q in zip(nodes[a], nodes[b])))
        return middle[key]

    cells = [c + [mid(c[i], c[(i + 1) % len(c)]) for i in range(len(c))] for c in cells]
    surfaces = {name: [(a, b, mid(a, b)) for a, b in facets] for name, facets in surfaces.items()}
    return nodes, cells, surfaces


def write(path, nodes, bodies, surfaces):
    """bodies: {name: (kind, order, cells)}; surfaces: {name: facets}."""
    names = [(2, k + 1, name) for k, name in enumerate(bodies)] + [(1, k + 101, name) for k, name in enumerate(surfaces)]
    elements = []
    for tag, name in enumerate(surfaces, 101):
        elements += [[8 if len(f) == 3 else 1, 2, tag, tag, *(n + 1 for n in f)] for f in surfaces[name]]
    for tag, (kind, order, cells) in enumerate(bodies.values(), 1):
        elements += [[KIND[kind, order], 2, tag, tag, *(n + 1 for n in c)] for c in cells]
    text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    text += [f'{dim} {tag} "{name}"' for dim, tag, name in names] + ["$EndPhysicalNames", "$Nodes", str(len(nodes))]
    text += [f"{k} {x!r} {y!r} 0" for k, (x, y) in enumerate(nodes, 1)] + ["$EndNodes", "$Elements", str(len(elements))]
    text += [f"{k} " + " ".join(map(str, e)) for k, e in enumerate(elements, 1)] + ["$EndElements", ""]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(text))


def spread(n, amplitude, phase):
    """n + 1 positions from 0 to 1, unevenly spread."""
    return [0.0] + [(i + amplitude * math.sin(phase + 2.3 * i)) / n for i in range(1, n)] + [1.0]


def body(name, y0, height, nx, ny, phase):
    """A block 0.04 wide: distorted quadrilaterals, and triangles with slivers."""
    x, y = [0.04 * s for s in spread(nx, 0.25, phase)], [y0 + height * j / ny for j in range(ny + 1)]
    nodes, quads = grid(x, y)
    surfaces = lines(nx + 1, ny + 1)
    boundary = {n for facets in surfaces.values() for f in facets for n in f}
    moved = [
        p if k in boundary else (p[0] + 0.22 * 0.04 / nx * math.sin(phase + 5.1 * k), p[1] + 0.22 * height / ny * math.cos(phase + 3.7 * k))
        for k, p in enumerate(nodes)
    ]
    # Slivers: a node of the first inner row all but on the surface, its neighbours' corners below one degree.
    flat = list(moved)
    inner = 1 if y0 > 0 else ny - 1
    surface_y = y[0] if y0 > 0 else y[ny]
    for i in range(1, nx, 2):
        k = inner * (nx + 1) + i
        flat[k] = (moved[k + (nx + 1) * (-1 if y0 > 0 else 1)][0], surface_y + (flat[k][1] - surface_y) * 0.008)
    for kind, cells, points in [("quad", quads, moved), ("tri", triangles(quads), flat)]:
        for order in (1, 2):
            n, c, s = (points, cells, surfaces) if order == 1 else second_order(points, cells, surfaces)
            assert all(area([n[i] for i in cell[: 3 if kind == "tri" else 4]]) > 0 for cell in c)
            write(HERE / "distorted" / f"{name}-{kind}{order}.msh", n, {name: (kind, order, c)}, s)


def area(points):
    """The smallest of the areas of the corners: not positive in a cell that is turned over."""
    corner = lambda a, b, c: (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    n = len(points)
    return min(corner(points[i - 1], points[i], points[(i + 1) % n]) for i in range(n))


def bad():
    """One thing wrong in each: the lower block, 0.04 x 0.02, and both blocks in one file."""
    nodes, quads = grid([0.01 * i for i in range(5)], [0.0, 0.01, 0.02])
    surfaces = lines(5, 3)
    save = lambda name, n, q, s: write(HERE / "bad-input" / f"{name}.msh", n, {"lower": ("quad", 1, q)}, s)
    save("good", nodes, quads, surfaces)
    # The node in the middle of the contact surface twice: its right-hand cell has its own.
    twice = nodes + [nodes[12]]
    save("duplicate", twice, quads[:6] + [[7, 8, 13, 15]] + quads[7:], {**surfaces, "top": [(10, 11), (11, 12), (15, 13), (13, 14)]})
    # Two nodes of one side in one place.
    save("zero-edge", nodes[:11] + [nodes[12]] + nodes[12:], quads, surfaces)
    # A cell like a bow tie, and one folded over.
    save("bow-tie", nodes, [[quads[0][i] for i in (0, 2, 1, 3)]] + quads[1:], surfaces)
    save("folded", nodes[:6] + [(0.025, 0.005)] + nodes[7:], quads, surfaces)
    # Both bodies share the nodes of the interface.
    both, cells = grid([0.01 * i for i in range(5)], [0.0, 0.01, 0.02, 0.035, 0.05])
    outline = lines(5, 5)
    shared = {"bottom": outline["bottom"], "top": outline["top"], "interface": [(10 + i, 11 + i) for i in range(4)]}
    write(HERE / "bad-input" / "shared.msh", both, {"lower": ("quad", 1, cells[:8]), "upper": ("quad", 1, cells[8:])}, shared)


body("lower", 0.0, 0.02, 5, 3, 0.4)
body("upper", 0.02, 0.03, 7, 4, 1.3)
bad()
