"""Two bodies that yield pressed together by GetFEM: plasticity_with_getfem.py DIRECTORY APART LIFT0 LIFT1 YIELD HARDENING INCREMENTS AXIS0 AXIS1.

Reads bodies.mesh, both bodies in one mesh, the second lower by APART than it is (regions: 1, 3 the surfaces that are moved, 2, 4 those
that can touch, whose nodes are opposite); LIFT: displacement along y; YIELD: yield stress, which grows with the equivalent plastic strain
by HARDENING; AXIS: y of the node on x = 0 that keeps x. Writes displacements and von Mises stress, prints the Newton steps and the
contact force.
"""
import sys

import getfem as gf
import getfem_body as body
import numpy as np

FLATS, ARCS = (1, 3), (2, 4)
SYMMETRIC = 2
LITTLE = 1e-9

directory = sys.argv[1]
apart, *rest = (float(v) for v in sys.argv[2:])
lifts, (stress, hardening, increments), axes = rest[:2], rest[2:5], rest[5:]
md = body.model()
fem, node, rule = body.displaced(md, "u", gf.Mesh("load", f"{directory}/bodies.mesh"))
law = body.Yielding(md, "u", rule, fem, stress, hardening)
for b in (0, 1):
    body.lift(md, "u", fem, rule, FLATS[b], 0)
    body.pin(md, "u", axes[b] - b * apart, b)
# Opposite nodes, from left to right.
x, y = node.basic_dof_nodes()
upper, lower = (sorted(node.basic_dof_on_region(arc), key=lambda n: x[n]) for arc in ARCS)
closing = gf.Spmat("empty", len(upper), fem.nbdof())
for row, (a, b) in enumerate(zip(upper, lower)):
    closing.add(row, 2 * a + 1, -1.0)
    closing.add(row, 2 * b + 1, 1.0)
md.add_variable("pressing", len(upper))
md.add_initialized_data("gap", y[upper] - y[lower] - apart)
md.add_initialized_data("alpha", np.ones(len(upper)))
md.add_basic_contact_brick("u", "pressing", "r", closing, "gap", "alpha", SYMMETRIC)
steps, ends = [], []
for i in range(1, int(increments) + 1):
    for b in (0, 1):
        md.set_variable(f"lift{FLATS[b]}u", [0, i / increments * lifts[b]])
    if not ends:
        # From the bodies moved with what moves them it finds the contact only while they are elastic. Its law has no derivative where
        # there is no strain at all.
        start = np.zeros(fem.nbdof())
        start[::2] = LITTLE * x
        start[1::2] = np.where(y > -0.5 * apart, *lifts) / increments
        md.set_variable("u", start)
        steps.append(law.elastic(md))
    elif len(ends) > 1:
        # From the last increment repeated.
        md.set_variable("u", 2 * ends[-1] - ends[-2])
    steps.append(body.solve(md))
    law.next(md)
    ends.append(md.variable("u"))
body.export(md, "u", fem, node, f"{directory}/bodies.vtk")
print("newton", *steps)
print("steps", sum(steps))
print("force", sum(-md.variable("pressing")))
