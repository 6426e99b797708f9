//! The bodies joined by contact rows: one force step or displacement step of all of them.
//!
//! Every pair has one multiplier per row, held by the group of the body on its multiplier side. The other body sees the
//! same rows through the transposed operator. Only row forces and row displacements are exchanged.
use super::{Respond, Spring};
use crate::{
    contact::{Coefficients, Law},
    error::{Error, Result},
    parallel::{Exchange, Partner},
    vector::all_finite,
};
use std::ops::Range;

/// One side of a pair as the first rank of its body's group holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    /// Pair index in the case.
    pub pair: usize,
    /// True where the multipliers live.
    pub multiplier: bool,
    /// Index of the body among this rank's.
    pub body: usize,
    /// The pair's rows among the body's.
    pub rows: Range<usize>,
    /// Of these, those that only show the other side where this one is: their forces do not act here. None but with the
    /// paper's transfer between nodes that do not match.
    pub watched: Vec<usize>,
}

/// The rows of a pair, on its multiplier side: of a pair with a tangential law the normal rows, then as many tangential ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairRows {
    /// Initial gap of each row, m; of a tangential row how far the surfaces had moved apart at the last accepted state.
    pub gap: Vec<f64>,
    /// What a pair with tangential rows does on them.
    pub law: Law,
    /// Of each normal row, where these vary; empty: those of the law.
    pub coefficients: Vec<Coefficients>,
    /// Weight of each row's multiplier, m2; 1 if none are given.
    pub area: Vec<f64>,
    /// Place of each normal row along the surface, m; empty if none are given.
    pub along: Vec<f64>,
    /// Estimate of the local stiffness against approach of the two surfaces at a row, N/m: thickness / (1/E'_A + 1/E'_B).
    /// Sets scales and a first guess, never the solution.
    pub stiffness: f64,
    /// Compliance of the multiplier side over that of the mortar side against short waves: the ratio of their moduli,
    /// E'_mortar / E'_multiplier; infinite for a rigid mortar side.
    pub compliance_ratio: f64,
    /// The mortar side has fewer nodes than there are rows: its displacements cannot follow all of them.
    pub mortar_is_coarse: bool,
    /// One of the two bodies is in contact elsewhere, too.
    pub in_chain: bool,
    /// Side in the case of the multipliers: 0 is A.
    pub side: usize,
    /// Per row: whether the multiplier side and the mortar side cannot give way, held by supports or rigid.
    pub held: Vec<[bool; 2]>,
    /// Rows whose forces do not act on the multiplier side and on the mortar side.
    pub interpolated: [Vec<Interpolated>; 2],
}

/// A row whose force does not act on a side: the force at its place there is a mean of those of other rows (28).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Interpolated {
    /// The row.
    pub row: usize,
    /// The others, with their weights.
    pub terms: Vec<(usize, f64)>,
}

/// How many steps the bodies have made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Steps {
    /// Force steps.
    pub force: usize,
    /// Displacement steps.
    pub displacement: usize,
}

/// The multiplier side's share of a displacement step, in [0, 1]; the mortar side has the rest.
pub type Share = f64;

/// The bodies of this rank and their rows. A *row vector* has an entry per row of this rank's multiplier ends, and after
/// them one per spring of its bodies' soft modes: a row that is always active and whose force may have either sign.
pub struct Coupling<'a, B> {
    /// This rank's bodies.
    pub bodies: &'a mut [B],
    /// This rank's ends of pairs.
    pub ends: &'a [End],
    /// To the other ends.
    pub exchange: &'a Exchange<'a>,
    /// Per end: its rows in a row vector; empty for mortar ends.
    pub ranges: Vec<Range<usize>>,
    /// The springs: index of the body among this rank's, and the spring.
    pub springs: Vec<(usize, Spring)>,
    /// Number of contact rows.
    pub n_rows: usize,
    /// Length of a row vector.
    pub n: usize,
    /// Counters.
    pub steps: Steps,
    /// The bodies' names, for messages; may be left empty.
    pub names: Vec<String>,
}

/// What a body was asked for, in messages.
const FREE: &str = "without contact forces";
const FORCE_STEP: &str = "under contact forces (force step)";
const DISPLACEMENT_STEP: &str = "to a displacement of its contact surface (displacement step)";

/// The gate that no answer of a body passes which is not finite: maxima and comparisons after it need not think of that.
fn finite<'v>(names: &[String], answers: impl IntoIterator<Item = &'v [f64]>, question: &str) -> Result<()> {
    let Some(b) = answers.into_iter().position(|values| !all_finite(values)) else { return Ok(()) };
    let name =
        names.get(b).map_or_else(|| format!("number {} of its rank", b + 1), |name| format!("'{name}'"));
    Err(Error::NotFinite(format!("body {name}: its answer {question} is not a finite number")))
}

impl PairRows {
    /// Number of normal rows.
    pub fn n_normal(&self) -> usize {
        if self.law.is_frictional() { self.gap.len() / 2 } else { self.gap.len() }
    }

    /// Of a normal row: mu, and the bound of the tangential force at no pressure, N.
    pub fn bounds(&self, k: usize) -> [f64; 2] {
        let [friction, shear] = self.coefficients.get(k).copied().unwrap_or(self.law.coefficients());
        [friction, shear * self.area.get(k).copied().unwrap_or(1.0)]
    }
}

impl<'a, B: Respond> Coupling<'a, B> {
    /// Joins the bodies. Not collective.
    pub fn new(bodies: &'a mut [B], ends: &'a [End], exchange: &'a Exchange<'a>) -> Self {
        let mut n_rows = 0;
        let ranges = ends
            .iter()
            .map(|end| {
                let length = if end.multiplier { end.rows.len() } else { 0 };
                n_rows += length;
                n_rows - length..n_rows
            })
            .collect();
        let of_body =
            |(i, body): (usize, &B)| body.springs().iter().map(move |s| (i, *s)).collect::<Vec<_>>();
        let springs: Vec<(usize, Spring)> = bodies.iter().enumerate().flat_map(of_body).collect();
        let n = n_rows + springs.len();
        Coupling {
            bodies,
            ends,
            exchange,
            ranges,
            springs,
            n_rows,
            n,
            steps: Steps::default(),
            names: Vec::new(),
        }
    }

    /// Outward displacements of the rows without contact forces, of both sides together, m. Collective on the roots.
    pub fn free(&self) -> Vec<f64> {
        let [own, other] =
            self.to_multipliers(|bodies, end| bodies[end.body].free()[end.rows.clone()].to_vec());
        std::iter::zip(own, other).map(|(a, b)| a + b).collect()
    }

    /// That the bodies' free displacements, and the gaps `gap` that they leave, are finite. Collective on the roots.
    pub fn check_free(&self, gap: &[f64]) -> Result<()> {
        let checked = finite(&self.names, self.bodies.iter().map(|b| b.free()), FREE).and_then(|()| {
            match all_finite(gap) {
                true => Ok(()),
                false => Err(Error::NotFinite("the gap between two surfaces is not a finite number".into())),
            }
        });
        self.exchange.agree(checked)
    }

    /// Force step: how far the row forces push the multiplier sides and the mortar sides inwards, m. Collective on the
    /// roots.
    pub fn force_step(&mut self, force: &[f64]) -> Result<[Vec<f64>; 2]> {
        self.steps.force += 1;
        let forces = self.on_bodies([force; 2]);
        let mut answers = self.answers(FORCE_STEP, |b, body| body.force_step(&forces[b]))?;
        for (j, (_, spring)) in (self.n_rows..).zip(&self.springs) {
            answers[0][j] = force[j] / spring.stiffness;
        }
        Ok(answers)
    }

    /// What each side of the active rows adds to its forces, N, if it is pushed inwards by its own of `inward`, m: multiplier
    /// and mortar sides. One displacement step of all bodies. Collective on the roots.
    pub fn push(&mut self, inward: [&[f64]; 2], active: &[bool]) -> Result<[Vec<f64>; 2]> {
        self.steps.displacement += 1;
        let flags: Vec<f64> = active.iter().map(|a| f64::from(u8::from(*a))).collect();
        let (inward, flags) = (self.on_bodies(inward), self.on_bodies([&flags; 2]));
        self.answers(DISPLACEMENT_STEP, |b, body| {
            let active: Vec<bool> = flags[b].iter().map(|f| *f > 0.5).collect();
            body.displacement_step(&inward[b], &active)
        })
    }

    /// How far the multiplier and the mortar sides have moved, in any direction, under all loads and the row forces, m.
    /// Collective on the roots.
    pub fn distances(&mut self, force: &[f64]) -> Result<[Vec<f64>; 2]> {
        let forces = self.on_bodies([force; 2]);
        self.answers(FORCE_STEP, |b, body| body.distances(&forces[b]))
    }

    /// Row vectors of the multiplier and the mortar sides, brought to the bodies' rows; zero where rows are watched only.
    fn on_bodies(&self, values: [&[f64]; 2]) -> Vec<Vec<f64>> {
        let of_ends = |values: &[f64]| -> Vec<Vec<f64>> {
            self.ranges.iter().map(|range| values[range.clone()].to_vec()).collect()
        };
        let own = of_ends(values[0]);
        let received = self.exchange.swap(&of_ends(values[1]));
        let mut on_bodies: Vec<Vec<f64>> = self.bodies.iter().map(|b| vec![0.0; b.n_rows()]).collect();
        for (i, end) in self.ends.iter().enumerate() {
            let rows = &mut on_bodies[end.body][end.rows.clone()];
            rows.copy_from_slice(if end.multiplier { &own[i] } else { &received[i] });
            end.watched.iter().for_each(|&k| rows[k] = 0.0);
        }
        on_bodies
    }

    /// The answers of all bodies, the gate passed, brought to the multiplier ends.
    fn answers(
        &mut self,
        question: &str,
        mut answer: impl FnMut(usize, &mut B) -> Result<Vec<f64>>,
    ) -> Result<[Vec<f64>; 2]> {
        let answers = self.bodies.iter_mut().enumerate().map(|(b, body)| answer(b, body));
        let checked = answers.collect::<Result<Vec<_>>>().and_then(|answers| {
            finite(&self.names, answers.iter().map(Vec::as_slice), question)?;
            Ok(answers)
        });
        let answers = self.exchange.agree(checked)?;
        Ok(self.to_multipliers(|_, end| answers[end.body][end.rows.clone()].to_vec()))
    }

    /// Displacement step: the forces, N, with which the bodies resist being pushed inwards by `inward` on the active rows,
    /// each by its share of it and counting by its share (`share`, given on multiplier ends): the sum of D S D over the
    /// bodies, D being a body's shares of its rows. Collective on the roots.
    pub fn displacement_step(
        &mut self,
        inward: &[f64],
        active: &[bool],
        share: &[Share],
    ) -> Result<Vec<f64>> {
        let flags: Vec<f64> = active.iter().map(|a| f64::from(u8::from(*a))).collect();
        let forces = self.ask([inward, &flags], share, |body, inward, flags, _| {
            let active: Vec<bool> = flags.iter().map(|f| *f > 0.5).collect();
            match active.contains(&true) {
                true => body.displacement_step(inward, &active).map(Some),
                false => Ok(Some(vec![0.0; active.len()])),
            }
        })?;
        let mut forces: Vec<f64> = forces.into_iter().map(Option::unwrap_or_default).collect();
        for (j, (_, spring)) in (self.n_rows..).zip(&self.springs) {
            forces[j] = spring.stiffness * inward[j];
        }
        Ok(forces)
    }

    /// Unilateral displacement step of the bodies with the larger shares: each alone against the others held fast, which leave it the
    /// gaps `gap`, while the rows that it does not lead carry the forces `held`, and so do the springs. `None` where a
    /// body has no answer. Collective on the roots.
    pub fn unilateral_step(
        &mut self,
        gap: &[f64],
        held: &[f64],
        share: &[Share],
    ) -> Result<Vec<Option<f64>>> {
        let lead: Vec<Share> = share.iter().map(|s| if *s >= 0.5 { 1.0 } else { 0.0 }).collect();
        // Both sides know the forces held, whoever leads.
        let on_bodies = self.on_bodies([held; 2]);
        let held_springs = held[self.n_rows..].to_vec();
        let ones = vec![1.0; self.n];
        let mut on_bodies = on_bodies.into_iter();
        let mut forces = self.ask([gap, &ones], &lead, |body, gap, flags, chosen| {
            let held = on_bodies.next().unwrap_or_default();
            if !chosen {
                return Ok(None);
            }
            let flags: Vec<bool> = flags.iter().map(|f| *f > 0.5).collect();
            body.unilateral_step(gap, &flags, &held)
        })?;
        std::iter::zip(&mut forces[self.n_rows..], held_springs)
            .for_each(|(force, held)| *force = Some(held));
        Ok(forces)
    }

    /// A step of all bodies that have a share: per row they get the first value times their share (zero where they have
    /// none) and the second one, and whether they have any share; their answers count by the shares. `None` at the rows for
    /// which a body with a share has no answer.
    fn ask(
        &mut self,
        values: [&[f64]; 2],
        share: &[Share],
        mut step: impl FnMut(&mut B, &[f64], &[f64], bool) -> Result<Option<Vec<f64>>>,
    ) -> Result<Vec<Option<f64>>> {
        self.steps.displacement += 1;
        let given = |i: usize, share: Share| -> [Vec<f64>; 2] {
            let range = self.ranges[i].clone();
            [values[0][range.clone()].iter().map(|v| share * v).collect(), values[1][range].to_vec()]
        };
        // A mortar end is asked by a message of values; an empty one asks for nothing.
        let ask = |i: usize, end: &End| match end.multiplier && share[i] < 1.0 {
            true => given(i, 1.0 - share[i]).concat(),
            false => Vec::new(),
        };
        let out: Vec<Vec<f64>> = self.ends.iter().enumerate().map(|(i, end)| ask(i, end)).collect();
        let received = self.exchange.swap(&out);
        let mut asked: Vec<[Vec<f64>; 2]> =
            self.bodies.iter().map(|b| [vec![0.0; b.n_rows()], vec![0.0; b.n_rows()]]).collect();
        let mut takes_part = vec![false; self.bodies.len()];
        for (i, end) in self.ends.iter().enumerate() {
            let n = end.rows.len();
            let of_end = if end.multiplier && share[i] > 0.0 {
                given(i, share[i])
            } else if !end.multiplier && received[i].len() == 2 * n {
                let (first, second) = received[i].split_at(n);
                [first.to_vec(), second.to_vec()]
            } else {
                continue;
            };
            takes_part[end.body] = true;
            for (asked, of_end) in std::iter::zip(&mut asked[end.body], &of_end) {
                asked[end.rows.clone()].copy_from_slice(of_end);
            }
        }
        let answers = self.bodies.iter_mut().zip(std::iter::zip(&asked, &takes_part));
        let answers =
            answers.map(|(body, (v, part))| step(body, &v[0], &v[1], *part)).collect::<Result<Vec<_>>>();
        let checked = answers.and_then(|answers| {
            let given = answers.iter().map(|answer| answer.as_deref().unwrap_or_default());
            finite(&self.names, given, DISPLACEMENT_STEP)?;
            Ok(answers)
        });
        let answers = self.exchange.agree(checked)?;
        // No answer is an empty message.
        let of_end =
            |end: &End| answers[end.body].as_ref().map_or_else(Vec::new, |a| a[end.rows.clone()].to_vec());
        let mine: Vec<Vec<f64>> = self.ends.iter().map(of_end).collect();
        let out: Vec<Vec<f64>> = std::iter::zip(self.ends, &mine)
            .map(|(end, values)| if end.multiplier { Vec::new() } else { values.clone() })
            .collect();
        let received = self.exchange.swap(&out);
        let mut forces = vec![Some(0.0); self.n];
        for (i, _) in self.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let range = self.ranges[i].clone();
            for (side, share) in [(&mine[i], share[i]), (&received[i], 1.0 - share[i])] {
                if share > 0.0 {
                    for (k, force) in forces[range.clone()].iter_mut().enumerate() {
                        *force = force.zip(side.get(k)).map(|(sum, f)| sum + share * f);
                    }
                }
            }
        }
        Ok(forces)
    }

    /// Values on the rows of all ends, brought to the multiplier ends: the end's own, and the mortar end's.
    pub fn to_multipliers(&self, values: impl Fn(&[B], &End) -> Vec<f64>) -> [Vec<f64>; 2] {
        let mine: Vec<Vec<f64>> = self.ends.iter().map(|end| values(self.bodies, end)).collect();
        let out: Vec<Vec<f64>> = std::iter::zip(self.ends, &mine)
            .map(|(end, values)| if end.multiplier { Vec::new() } else { values.clone() })
            .collect();
        let received = self.exchange.swap(&out);
        let mut own = vec![0.0; self.n];
        let mut other = vec![0.0; self.n];
        for (i, _) in self.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let range = self.ranges[i].clone();
            own[range.clone()].copy_from_slice(&mine[i]);
            if !matches!(self.exchange.partners[i], Partner::Rigid) {
                other[range].copy_from_slice(&received[i]);
            }
        }
        [own, other]
    }

    /// Sum over all rows of all ranks. Collective on the roots.
    pub fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.exchange.sum(&[std::iter::zip(a, b).map(|(a, b)| a * b).sum()])[0]
    }
}
