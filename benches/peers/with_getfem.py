"""Hertz contact of two bodies by GetFEM: with_getfem.py DIRECTORY LIFT0 LIFT1 AXIS0 AXIS1.

Reads body0.mesh and body1.mesh (regions: 1 the flat, 2 the arc); LIFT: displacement of the flats along y; AXIS: y of the node
on x = 0 that keeps x. Writes displacements and von Mises stress, prints the Newton steps and the peak pressure.
"""
import sys

import getfem as gf
import numpy as np

E, NU = 2.1e11, 0.3
LAMBDA, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
FLAT, ARC = 1, 2
SLAVE, MASTER, SYMMETRIC = 1, 0, 2
# Residual, and how much a full Newton step may make it larger before it is shortened.
STOP, GROWTH = 1e-8, 1e9

directory = sys.argv[1]
lifts, axes = [[float(v) for v in sys.argv[i : i + 2]] for i in (2, 4)]
md = gf.Model("real")
md.add_initialized_data("lambda", [LAMBDA])
md.add_initialized_data("mu", [MU])
md.add_initialized_data("r", [0.1 * E])
md.add_initialized_data("along_x", [1, 0])
md.add_initialized_data("along_y", [0, 0, 0, 1], [2, 2])
fems, nodes, rules = [], [], []
for b in (0, 1):
    mesh = gf.Mesh("load", f"{directory}/body{b}.mesh")
    fems.append(gf.MeshFem(mesh, 2))
    nodes.append(gf.MeshFem(mesh, 1))
    for fem in fems[b], nodes[b]:
        fem.set_fem(gf.Fem("FEM_QK(2,1)"))
    rules.append(gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2,3)")))
    u = f"u{b}"
    md.add_fem_variable(u, fems[b])
    md.add_isotropic_linearized_elasticity_brick(rules[b], u, "lambda", "mu")
    md.add_initialized_data(f"lift{b}", [0, lifts[b]])
    md.add_generalized_Dirichlet_condition_with_multipliers(rules[b], u, fems[b], FLAT, f"lift{b}", "along_y")
    md.add_initialized_data(f"axis{b}", [0, axes[b]])
    md.add_pointwise_constraints_with_multipliers(u, f"axis{b}", "along_x")
md.add_nodal_contact_between_nonmatching_meshes_brick(
    rules[0], rules[1], "u0", "u1", "force", "r", ARC, ARC, SLAVE, MASTER, SYMMETRIC
)
steps, converged = md.solve(
    "max_res", STOP, "max_iter", 50, "lsolver", "mumps", "lsearch", "simplest", "alpha max ratio", GROWTH
)
if not converged:
    sys.exit("not converged")
for b in (0, 1):
    mises = md.compute_isotropic_linearized_Von_Mises_or_Tresca(f"u{b}", "lambda", "mu", nodes[b])
    fems[b].export_to_vtk(
        f"{directory}/body{b}.vtk", fems[b], md.variable(f"u{b}"), "displacement", nodes[b], mises, "von Mises"
    )
# Pressure at a node: its force on the length it stands for.
length = gf.asm_boundary_source(ARC, rules[0], nodes[0], nodes[0], np.ones((1, nodes[0].nbdof())))
length = length[nodes[0].basic_dof_on_region(ARC)]
print("steps", steps)
print("peak pressure", max(-md.variable("force") / length))
