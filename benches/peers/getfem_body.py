"""What both scenes have in common: elastic bodies in plane strain, their supports, Newton steps, results."""
import sys

import getfem as gf

E, NU = 2.1e11, 0.3
LAMBDA, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
# Residual, and how much a full Newton step may make it larger before it is shortened.
STOP, GROWTH = 1e-8, 1e9


def model():
    md = gf.Model("real")
    md.add_initialized_data("lambda", [LAMBDA])
    md.add_initialized_data("mu", [MU])
    md.add_initialized_data("r", [0.1 * E])
    md.add_initialized_data("along_x", [1, 0])
    md.add_initialized_data("along_y", [0, 0, 0, 1], [2, 2])
    return md


def displaced(md, u, mesh):
    """A mesh with displacements `u`: their fem, that of a scalar, the quadrature."""
    fem, node = gf.MeshFem(mesh, 2), gf.MeshFem(mesh, 1)
    for f in fem, node:
        f.set_fem(gf.Fem("FEM_QK(2,1)"))
    rule = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2,3)"))
    md.add_fem_variable(u, fem)
    return fem, node, rule


def elastic(md, u, mesh):
    """The same, elastic."""
    fem, node, rule = displaced(md, u, mesh)
    md.add_isotropic_linearized_elasticity_brick(rule, u, "lambda", "mu")
    return fem, node, rule


class Yielding:
    """Linear isotropic hardening in plane strain, the plastic multiplier eliminated at the points."""

    LAW = "plane strain Prandtl Reuss linear hardening", "DISPLACEMENT_ONLY"

    # Times the yield stress, which nothing reaches.
    ELASTIC = 1e9

    def __init__(self, md, u, rule, fem, stress, hardening):
        self.stress = stress
        for name, value in {"stress_y": stress, "hardening": hardening}.items():
            md.add_initialized_data(name, [value])
        md.add_fem_data(f"Previous_{u}", fem)
        for name, size in {"xi": [1], "Previous_xi": [1], "Previous_alpha": [1], "Previous_Ep": [2, 2]}.items():
            md.add_im_data(name, gf.MeshImData(rule, -1, size))
        parameters = "lambda", "mu", "stress_y", "0", "hardening", "1", "1"
        self.arguments = rule, *self.LAW, u, "xi", "Previous_Ep", "Previous_alpha", *parameters
        md.add_small_strain_elastoplasticity_brick(*self.arguments)

    def elastic(self, md):
        """Newton steps of bodies that do not yield."""
        md.set_variable("stress_y", [self.ELASTIC * self.stress])
        steps = solve(md)
        md.set_variable("stress_y", [self.stress])
        return steps

    def next(self, md):
        """What has yielded counts from here."""
        md.small_strain_elastoplasticity_next_iter(*self.arguments)


def lift(md, u, fem, rule, region, height):
    """The region moves along y."""
    name = f"lift{region}{u}"
    md.add_initialized_data(name, [0, height])
    md.add_generalized_Dirichlet_condition_with_multipliers(rule, u, fem, region, name, "along_y")


def pin(md, u, y, which=0):
    """The node at (0, y) keeps x; `which`: of the pinned ones."""
    name = f"pin{which}{u}"
    md.add_initialized_data(name, [0, y])
    md.add_pointwise_constraints_with_multipliers(u, name, "along_x")


def solve(md):
    """Newton steps."""
    options = "max_res", STOP, "max_iter", 50, "lsolver", "mumps", "lsearch", "simplest", "alpha max ratio", GROWTH
    steps, converged = md.solve(*options)
    if not converged:
        sys.exit("not converged")
    return steps


def lengths(rule, node, region):
    """What a node stands for of a region."""
    return gf.asm_boundary_source(region, rule, node, node, [[1.0] * node.nbdof()])


def export(md, u, fem, node, file):
    mises = md.compute_isotropic_linearized_Von_Mises_or_Tresca(u, "lambda", "mu", node)
    fem.export_to_vtk(file, fem, md.variable(u), "displacement", node, mises, "von Mises")
