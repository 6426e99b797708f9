"""Two bodies pressed together, then sheared, by GetFEM: friction_with_getfem.py DIRECTORY APART LIFT0 LIFT1 PULL0 PULL1 FRICTION AXIS.

Reads bodies.mesh, both bodies in one mesh, the second lower by APART than it is (regions: 1, 3 the flats, 2, 4 the arcs, whose nodes
match); LIFT: displacement of the flats along y; PULL: their traction along x in the second step; AXIS: y of the second body's node on
x = 0 that keeps x. Writes displacements and von Mises stress of both steps and traction.txt: x and tangential traction of the nodes,
prints the Newton steps.
"""
import sys

import getfem as gf
import getfem_body as body
import numpy as np

FLATS, ARCS = (1, 3), (2, 4)
# Symmetric but for the coupling of friction and pressure.
SYMMETRIC = 2

directory = sys.argv[1]
apart, *rest = (float(v) for v in sys.argv[2:])
lifts, pulls, (friction, axis) = rest[:2], rest[2:4], rest[4:]
md = body.model()
fem, node, rule = body.elastic(md, "u", gf.Mesh("load", f"{directory}/bodies.mesh"))
for b in (0, 1):
    body.lift(md, "u", fem, rule, FLATS[b], lifts[b])
    md.add_initialized_data(f"pull{b}", [0, 0])
    md.add_source_term_brick(rule, "u", f"pull{b}", FLATS[b])
body.pin(md, "u", axis - apart)
# Opposite nodes, from left to right; both normals are y, their mean.
x, y = node.basic_dof_nodes()
upper, lower = (sorted(node.basic_dof_on_region(arc), key=lambda n: x[n]) for arc in ARCS)
closing, slip = (gf.Spmat("empty", len(upper), fem.nbdof()) for _ in "nt")
for row, (a, b) in enumerate(zip(upper, lower)):
    closing.add(row, 2 * a + 1, -1.0)
    closing.add(row, 2 * b + 1, 1.0)
    slip.add(row, 2 * a, 1.0)
    slip.add(row, 2 * b, -1.0)
for name in "pressing", "shearing":
    md.add_variable(name, len(upper))
for name, value in {
    "friction": [friction],
    "gap": y[upper] - y[lower] - apart,
    "alpha": np.ones(len(upper)),
    "gamma": [1],
    "before": np.zeros(fem.nbdof()),
}.items():
    md.add_initialized_data(name, value)
md.add_basic_contact_brick(
    "u", "pressing", "shearing", "r", closing, slip, "friction", "gap", "alpha", SYMMETRIC, "gamma", "before"
)
# The first step starts from both bodies moved with their flats.
start = md.variable("u")
start[1::2] = np.where(y > -0.5 * apart, *lifts)
md.set_variable("u", start)
steps = []
for share in (0, 1):
    for b in (0, 1):
        md.set_variable(f"pull{b}", [share * pulls[b], 0])
    steps.append(body.solve(md))
    # Slip counts from here.
    md.set_variable("before", md.variable("u"))
    body.export(md, "u", fem, node, f"{directory}/step{share}.vtk")
traction = md.variable("shearing") / body.lengths(rule, node, ARCS[0])[upper]
np.savetxt(f"{directory}/traction.txt", np.column_stack([x[upper], traction]))
print("steps", sum(steps))
