//! A Schur complement in two levels: most of a matrix stays, and only a zone of it changes.
//!
//! The cells of the rest are condensed once to the unknowns K that they share with the zone or with the interface B. A
//! new matrix of the zone then costs a factorisation of the zone's cells together with the dense complement S_K of the rest:
//! the same S, reductions and expansions as a [`SchurFactor`] of everything, by less work.
use super::{
    SchurFactor,
    handle::int,
    schur::{Times, Triples},
};
use crate::error::{Error, Result};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{cell::RefCell, rc::Rc};

/// (rows, columns, values) of a symmetric matrix: entries below the diagonal and those with a negative row or column do not
/// count, equal positions are summed.
pub type SymmetricTriples<'t> = (&'t [i32], &'t [i32], &'t [f64]);

/// The part of a matrix that stays, condensed. Bodies on one rank.
pub struct Rest {
    /// Of the rest's unknowns, in the order of `unknowns`, with K condensed out.
    factor: SchurFactor,
    /// The unknowns that the rest's cells touch, ascending.
    unknowns: Vec<usize>,
    /// K among `unknowns`.
    edge: Vec<usize>,
    /// Of the rest on K: its lower triangle counts, row by row.
    complement: Vec<f64>,
    /// The unknowns of the matrix of the zone, ascending: all but the rest's interior.
    zone: Vec<usize>,
    /// K among `zone`.
    edge_in_zone: Vec<usize>,
    /// B.
    interface: Vec<usize>,
    prefix: String,
    reduced: RefCell<Option<Reduced>>,
}

/// The last reduction of the rest.
struct Reduced {
    /// b of the rest's unknowns, zero on K.
    inside: Vec<f64>,
    /// -A_KI A_II^-1 b_I.
    on_edge: Vec<f64>,
}

/// A factor of a matrix whose rest is condensed: a [`SchurFactor`]'s two halves of a solve. Vectors are of all unknowns.
pub struct ZoneFactor {
    rest: Rc<Rest>,
    /// Of the zone's unknowns.
    factor: SchurFactor,
    /// Places, among the triples of the zone, of the entries that count.
    counted: Vec<usize>,
    /// Number of all triples of the zone.
    n_triples: usize,
}

impl Rest {
    /// Condenses the rest of a matrix of `n` unknowns: the `triples` of its cells, with the rows of ones of held unknowns
    /// that the zone's do not have. `interface`: B, in the order of S. `in_zone`: unknowns that cells of the zone touch.
    /// PETSc's options for MUMPS with the `prefix` apply. An interior of the rest that is not positive definite is
    /// [`Error::Indefinite`].
    pub fn new(
        group: &SimpleCommunicator,
        n: usize,
        triples: SymmetricTriples,
        interface: &[i32],
        in_zone: &[bool],
        prefix: &str,
    ) -> Result<Rest> {
        assert!(group.size() == 1 && in_zone.len() == n);
        int(n)?;
        let interface: Vec<usize> = interface.iter().map(|&i| i as usize).collect();
        let mut in_rest = vec![false; n];
        for (row, column) in std::iter::zip(triples.0, triples.1).filter(|(i, j)| counts(**i, **j)) {
            (in_rest[*row as usize], in_rest[*column as usize]) = (true, true);
        }
        let mut is_inside: Vec<bool> =
            std::iter::zip(&in_rest, in_zone).map(|(rest, zone)| *rest && !*zone).collect();
        interface.iter().for_each(|&i| is_inside[i] = false);
        let unknowns: Vec<usize> = (0..n).filter(|&i| in_rest[i]).collect();
        let zone: Vec<usize> = (0..n).filter(|&i| !is_inside[i]).collect();
        let edge: Vec<usize> = (0..unknowns.len()).filter(|&i| !is_inside[unknowns[i]]).collect();
        let edge_in_zone = (0..zone.len()).filter(|&i| in_rest[zone[i]]).collect();
        let (numbered, _) = renumbered(triples, &places(n, &unknowns))?;
        let indices: Vec<i32> = edge.iter().map(|&i| i as i32).collect();
        // `Often`: a pivot that is not positive is an error.
        let (factor, complement) =
            SchurFactor::of_triples(group, unknowns.len(), numbered, &indices, prefix, Times::Often)?;
        Ok(Rest {
            factor: factor.without_matrix(),
            unknowns,
            edge,
            complement,
            zone,
            edge_in_zone,
            interface,
            prefix: prefix.to_owned(),
            reduced: RefCell::default(),
        })
    }

    /// The unknowns that a [`ZoneFactor`] factorises, ascending: the zone's, the interface and the edge between zone and
    /// rest.
    pub fn zone_unknowns(&self) -> &[usize] {
        &self.zone
    }

    /// Number of unknowns that the rest is condensed to.
    pub fn n_edge(&self) -> usize {
        self.edge.len()
    }

    /// b of the zone's unknowns with what the interior of the rest adds. Half a solve of the rest if its b has changed.
    fn reduce(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        let inside = self.inside(b);
        let mut reduced = self.reduced.borrow_mut();
        if reduced.as_ref().is_none_or(|last| last.inside != inside) {
            let on_edge = match inside.iter().all(|b| *b == 0.0) {
                true => vec![0.0; self.edge.len()],
                false => self.factor.reduce(group, &inside)?,
            };
            *reduced = Some(Reduced { inside, on_edge });
        }
        let mut of_zone: Vec<f64> = self.zone.iter().map(|&i| b[i]).collect();
        let on_edge = reduced.iter().flat_map(|last| &last.on_edge);
        std::iter::zip(&self.edge_in_zone, on_edge).for_each(|(&i, more)| of_zone[i] += more);
        Ok(of_zone)
    }

    /// Of the unknowns K that the rest is condensed to: their numbers, and S_K x_K + A_KI A_II^-1 b_I of the b that was reduced last, what
    /// the rest does there, with x of all unknowns of which those of the rest's interior are not looked at.
    pub fn on_edge(&self, x: &[f64]) -> Vec<(usize, f64)> {
        let n = self.edge.len();
        let x_k: Vec<f64> = self.edge.iter().map(|&i| x[self.unknowns[i]]).collect();
        let mut f = vec![0.0; n];
        for i in 0..n {
            let row = &self.complement[i * n..][..=i];
            for (j, s) in row[..i].iter().enumerate() {
                f[i] += s * x_k[j];
                f[j] += s * x_k[i];
            }
            f[i] += row[i] * x_k[i];
        }
        if let Some(last) = &*self.reduced.borrow() {
            std::iter::zip(&mut f, &last.on_edge).for_each(|(f, more)| *f -= more);
        }
        self.edge.iter().map(|&i| self.unknowns[i]).zip(f).collect()
    }

    /// x of all unknowns from that of the zone's.
    fn expand(&self, group: &SimpleCommunicator, b: &[f64], of_zone: &[f64]) -> Result<Vec<f64>> {
        let on_edge: Vec<f64> = self.edge_in_zone.iter().map(|&i| of_zone[i]).collect();
        let of_rest = self.factor.expand(group, &self.inside(b), &on_edge)?;
        let mut x = vec![0.0; b.len()];
        std::iter::zip(&self.unknowns, of_rest).for_each(|(&i, value)| x[i] = value);
        std::iter::zip(&self.zone, of_zone).for_each(|(&i, value)| x[i] = *value);
        Ok(x)
    }

    /// b of the rest's unknowns, zero on K.
    fn inside(&self, b: &[f64]) -> Vec<f64> {
        let mut inside: Vec<f64> = self.unknowns.iter().map(|&i| b[i]).collect();
        self.edge.iter().for_each(|&i| inside[i] = 0.0);
        inside
    }
}

impl ZoneFactor {
    /// Factorises the matrix of `rest` and of the zone's `triples`; returns S as [`SchurFactor::new`] does. A matrix that is
    /// not positive definite on the unknowns besides B is [`Error::Indefinite`].
    pub fn new(
        group: &SimpleCommunicator,
        rest: Rc<Rest>,
        triples: SymmetricTriples,
    ) -> Result<(ZoneFactor, Vec<f64>)> {
        let n = rest.zone.len();
        let n_all = n + rest.unknowns.len() - rest.edge.len();
        let place = places(n_all, &rest.zone);
        let (mut matrix, counted) = renumbered(triples, &place)?;
        let k = rest.edge.len();
        for (i, row) in rest.edge_in_zone.iter().enumerate() {
            let complement = &rest.complement[i * k..][..=i];
            for (column, value) in std::iter::zip(&rest.edge_in_zone, complement) {
                matrix.push(*column as i32 + 1, *row as i32 + 1, *value);
            }
        }
        let interface: Vec<i32> = rest.interface.iter().map(|&i| place[i]).collect();
        let (factor, s) = SchurFactor::of_triples(group, n, matrix, &interface, &rest.prefix, Times::Often)?;
        Ok((ZoneFactor { rest, factor, counted, n_triples: triples.2.len() }, s))
    }

    /// Factorises anew, without a new analysis, and returns S: `values` of the zone's triples in their old places. After an
    /// error there is no factor until the next success.
    pub fn refactorise(&mut self, group: &SimpleCommunicator, values: &[f64]) -> Result<Vec<f64>> {
        assert_eq!(values.len(), self.n_triples);
        let matrix = self.factor.kept_mut()?;
        std::iter::zip(&mut matrix.values, &self.counted).for_each(|(value, &i)| *value = values[i]);
        self.factor.factorise_again(group)
    }

    /// The condensed rest.
    pub fn rest(&self) -> &Rc<Rest> {
        &self.rest
    }

    /// b_B - A_BI A_II^-1 b_I. Half a solve of the zone; one of the rest as well if its part of b has changed.
    pub fn reduce(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        self.factor.reduce(group, &self.rest.reduce(group, b)?)
    }

    /// x of the [zone's unknowns](Rest::zone_unknowns), from x_B: no work in the rest if its part of b has been reduced.
    pub fn expand_zone(&self, group: &SimpleCommunicator, b: &[f64], x_b: &[f64]) -> Result<Vec<f64>> {
        self.factor.expand(group, &self.rest.reduce(group, b)?, x_b)
    }

    /// All of x, with x_I = A_II^-1 (b_I - A_IB x_B).
    pub fn expand(&self, group: &SimpleCommunicator, b: &[f64], x_b: &[f64]) -> Result<Vec<f64>> {
        self.rest.expand(group, b, &self.expand_zone(group, b, x_b)?)
    }
}

/// True for an entry on or above the diagonal that is not dropped.
fn counts(row: i32, column: i32) -> bool {
    row >= 0 && column >= row
}

/// Place of each unknown among the chosen ones, -1 for the others.
fn places(n: usize, chosen: &[usize]) -> Vec<i32> {
    let mut place = vec![-1; n];
    chosen.iter().zip(0..).for_each(|(&i, k)| place[i] = k);
    place
}

/// The entries that count, in the numbering of `place`, and their places among all of the triples.
fn renumbered((rows, columns, values): SymmetricTriples, place: &[i32]) -> Result<(Triples, Vec<usize>)> {
    assert!(rows.len() == values.len() && columns.len() == values.len());
    let counted: Vec<usize> = (0..rows.len()).filter(|&k| counts(rows[k], columns[k])).collect();
    let mut triples = Triples::default();
    for &k in &counted {
        let (row, column) = (place[rows[k] as usize], place[columns[k] as usize]);
        if row < 0 || column < 0 {
            return Err(Error::internal("cells of the zone touch unknowns inside the rest"));
        }
        triples.push(row + 1, column + 1, values[k]);
    }
    Ok((triples, counted))
}
