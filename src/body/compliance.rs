//! A body's answer to contact forces: the compliance of its contact nodes.
//!
//! For unit compressive forces at each contact row the body is solved once, with the one factorisation it has. After
//! that a force step and a displacement step are dense algebra on the group's first rank, and the stiffness matrix
//! is never factorised again, however often the contact set changes:
//! - force step: u = u_free + G R;
//! - displacement step: C_aa R_a = n.u_free - w on the active rows, with C_ij = -n_i . G_ij.
use super::Body;
use crate::{
    contact::vector::{combine, dot},
    error::{Error, Result},
    parallel,
    schwarz::RespondAtNodes,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Right-hand sides solved at once.
const BATCH: usize = 32;

/// A place where a contact force may act.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactRow {
    /// Index among the observed nodes.
    pub observed: usize,
    /// Outward unit normal: the force on the body is -R n.
    pub normal: [f64; 3],
}

/// The compliance of a body, held by the first rank of its group.
pub struct Compliance {
    rows: Vec<ContactRow>,
    /// Displacements at the observed nodes without contact forces, m.
    free: Vec<[f64; 3]>,
    /// Per row: displacements at the observed nodes under a unit force, m/N.
    response: Vec<Vec<[f64; 3]>>,
    /// C, m/N, symmetric positive definite.
    normal: DMatrix<f64>,
    /// Factor of C_aa and the active rows it belongs to.
    factor: Option<(Vec<usize>, Cholesky<f64, Dyn>)>,
    /// Factorisations of C_aa so far: one per change of the contact set.
    pub factorisations: usize,
}

impl Compliance {
    /// Displacements of the observed nodes without contact forces, m, on the group's first rank; empty elsewhere.
    /// `observed`: nodes by mesh number, the same on all ranks. Collective.
    pub fn free_displacements(
        body: &mut Body,
        group: &SimpleCommunicator,
        observed: &[u32],
    ) -> Result<Vec<[f64; 3]>> {
        let dim = body.dim();
        let u = body.solve(group, &vec![0.0; body.part.n_owned * dim])?;
        Ok(Observed::new(body, group, observed).read(group, &u, dim))
    }

    /// Solves the body for every row. `free`: [`Compliance::free_displacements`]; it and `rows` need be given on the
    /// first rank only. `None` on the other ranks. Collective.
    pub fn new(
        body: &mut Body,
        group: &SimpleCommunicator,
        observed: &[u32],
        free: Vec<[f64; 3]>,
        rows: Vec<ContactRow>,
    ) -> Result<Option<Compliance>> {
        let dim = body.dim();
        let mut packed =
            rows.iter().flat_map(|r| [r.observed as f64, r.normal[0], r.normal[1], r.normal[2]]).collect();
        parallel::broadcast(group, 0, &mut packed);
        let rows: Vec<ContactRow> = packed
            .chunks_exact(4)
            .map(|r| ContactRow { observed: r[0] as usize, normal: [r[1], r[2], r[3]] })
            .collect();
        let probe = Observed::new(body, group, observed);
        let mut response = Vec::with_capacity(rows.len());
        for batch in rows.chunks(BATCH) {
            let columns = body.solve_units(group, batch, observed)?;
            response.extend(columns.iter().map(|column| probe.read(group, column, dim)));
        }
        if group.rank() != 0 {
            return Ok(None);
        }
        let mut normal = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
            -dot(&rows[i].normal, &response[j][rows[i].observed])
        });
        // Symmetric by reciprocity; the solver's round-off is not.
        normal = 0.5 * (&normal + normal.transpose());
        Ok(Some(Compliance { rows, free, response, normal, factor: None, factorisations: 0 }))
    }

    /// Contact force vectors at the observed nodes, N.
    pub fn forces(&self, force: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.free.len()];
        for (row, f) in std::iter::zip(&self.rows, force) {
            let sum = &mut out[row.observed];
            *sum = combine([(1.0, &*sum), (-f, &row.normal)]);
        }
        out
    }
}

impl RespondAtNodes for Compliance {
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<[f64; 3]>> {
        let mut u = self.free.clone();
        for (column, f) in std::iter::zip(&self.response, force).filter(|(_, f)| **f != 0.0) {
            for (u, g) in std::iter::zip(&mut u, column) {
                (0..3).for_each(|c| u[c] += f * g[c]);
            }
        }
        Ok(u)
    }

    fn displacement_step(&mut self, prescribed: &[Option<f64>]) -> Result<Vec<f64>> {
        let mut force = vec![0.0; self.rows.len()];
        let active: Vec<usize> = (0..prescribed.len()).filter(|&i| prescribed[i].is_some()).collect();
        if active.is_empty() {
            return Ok(force);
        }
        let rhs = DVector::from_iterator(
            active.len(),
            active.iter().map(|&i| {
                let row = &self.rows[i];
                dot(&row.normal, &self.free[row.observed]) - prescribed[i].unwrap_or(0.0)
            }),
        );
        if self.factor.as_ref().is_none_or(|(rows, _)| *rows != active) {
            let c = self.normal.select_rows(&active).select_columns(&active);
            let factor = Cholesky::new(c).ok_or_else(|| {
                Error::internal(
                    "the compliance of the contact nodes is singular: do two contact nodes coincide?",
                )
            })?;
            self.factorisations += 1;
            self.factor = Some((active.clone(), factor));
        }
        if let Some((_, factor)) = &self.factor {
            let solution = factor.solve(&rhs);
            active.iter().zip(solution.iter()).for_each(|(&i, f)| force[i] = *f);
        }
        Ok(force)
    }
}

impl Body {
    /// Owned displacements under a unit compressive force at each row, and no other load. Collective.
    fn solve_units(
        &mut self,
        group: &SimpleCommunicator,
        rows: &[ContactRow],
        observed: &[u32],
    ) -> Result<Vec<Vec<f64>>> {
        let dim = self.dim();
        let n = self.part.n_owned * dim;
        let mut columns = vec![0.0; n * rows.len()];
        for (row, column) in std::iter::zip(rows, columns.chunks_exact_mut(n.max(1))) {
            let global = self.numbering.new_of_old[observed[row.observed] as usize] as usize;
            let first = self.part.first_owned;
            if (first..first + self.part.n_owned).contains(&global) {
                let node = global - first;
                (0..dim).for_each(|c| column[node * dim + c] = -row.normal[c]);
                let framed = self.model.constraints.to_frames(column, dim);
                column.copy_from_slice(&framed);
            }
        }
        let Some(ksp) = self.system.ksp() else {
            return Err(Error::internal("a condensed body has its own response"));
        };
        ksp.solve_many(group, n, rows.len(), &mut columns)?;
        self.cost.add(|c| c.solves += rows.len());
        let columns = columns.chunks_exact(n.max(1)).map(|c| self.model.constraints.from_frames(c, dim));
        let mut columns: Vec<Vec<f64>> = columns.collect();
        columns.resize(rows.len(), Vec::new());
        Ok(columns)
    }
}

impl Body {
    /// Displacements at chosen mesh nodes, m, from those at the owned nodes; on the first rank, empty elsewhere.
    /// Collective.
    pub fn at_nodes(&self, group: &SimpleCommunicator, owned: &[f64], nodes: &[u32]) -> Vec<[f64; 3]> {
        Observed::new(self, group, nodes).read(group, owned, self.dim())
    }
}

/// Where the observed nodes are, and how their values reach the first rank.
struct Observed {
    /// This rank's owned observed nodes, by owned index, in the order of the observed nodes.
    mine: Vec<usize>,
    /// On the first rank: observed index of each value as gathered.
    order: Vec<usize>,
}

impl Observed {
    fn new(body: &Body, group: &SimpleCommunicator, observed: &[u32]) -> Observed {
        let global: Vec<u32> = observed.iter().map(|&o| body.numbering.new_of_old[o as usize]).collect();
        let owner: Vec<u32> = global.iter().map(|&g| body.numbering.owner(g)).collect();
        let rank = group.rank() as u32;
        let of_rank = |r: u32| (0..global.len()).filter(|&i| owner[i] == r).collect::<Vec<_>>();
        let mine = of_rank(rank).into_iter().map(|i| global[i] as usize - body.part.first_owned).collect();
        let order = if rank == 0 { (0..group.size() as u32).flat_map(of_rank).collect() } else { Vec::new() };
        Observed { mine, order }
    }

    /// Vectors at the observed nodes, on the first rank. Collective.
    fn read(&self, group: &SimpleCommunicator, owned: &[f64], dim: usize) -> Vec<[f64; 3]> {
        let mine: Vec<f64> = self.mine.iter().flat_map(|&i| owned[i * dim..(i + 1) * dim].to_vec()).collect();
        let all = parallel::gather(group, &mine);
        let mut out = vec![[0.0; 3]; self.order.len()];
        for (values, &i) in all.chunks_exact(dim).zip(&self.order) {
            out[i][..dim].copy_from_slice(values);
        }
        out
    }
}
