//! What is known of the contact nodes from the steps before.
use super::{
    contacts::Contacts,
    rows::turned,
    state::{NodeState, PairState, State},
    task::{Scene, Task},
};
use crate::{
    contact::{Coefficients, Law, Row, vector::dot},
    schwarz::{End, Touch},
};

impl Contacts {
    /// What is known of the nodes of the multipliers, in the order of the row vector's ends; `None`: of the other side's own nodes.
    pub(super) fn known(&self, task: &Task, pairs: &[PairState]) -> Vec<Vec<Option<NodeState>>> {
        let known = State::nodes(pairs);
        let plan = task.scene.plan;
        let of_end = |(i, end): (usize, &End)| -> Vec<Option<NodeState>> {
            let Some(pair) = self.pairs[end.pair].as_ref().filter(|_| end.multiplier) else {
                return Vec::new();
            };
            let nodes = pair.own_rows().iter().map(|row| plan.surfaces[i].nodes[row.node as usize]);
            let of_node = |node| known.get(&(end.pair, plan.ends[i].side, node)).copied();
            nodes.map(of_node).chain(pair.rows[pair.n_own..].iter().map(|_| None)).collect()
        };
        self.shares.ends.iter().enumerate().map(of_end).collect()
    }

    /// How far the surfaces had slipped along each other at the last accepted state, seen from the rows as they are, per end,
    /// m: on multiplier ends of pairs with tangential rows, empty elsewhere. Collective on the roots.
    pub(super) fn travelled(&self, task: &Task) -> Vec<Vec<f64>> {
        let Scene { plan, exchange, .. } = task.scene;
        let own = |(i, end): (usize, &End)| -> Vec<f64> {
            let Some(pair) = self.pairs[end.pair].as_ref().filter(|pair| pair.law.is_frictional()) else {
                return Vec::new();
            };
            let u = self.at_surface(&plan.surfaces[i], end.body, task.from);
            let column = usize::from(!end.multiplier);
            let along =
                |row: &Row| turned(&row.terms[column]).iter().map(|(k, v)| dot(v, &u[*k as usize])).sum();
            pair.rows.iter().map(along).collect()
        };
        let mut own: Vec<Vec<f64>> = self.shares.ends.iter().enumerate().map(own).collect();
        let out: Vec<Vec<f64>> = std::iter::zip(&self.shares.ends, &own)
            .map(|(end, own)| if end.multiplier { Vec::new() } else { own.clone() })
            .collect();
        let received = exchange.swap(&out);
        for ((end, own), other) in std::iter::zip(&self.shares.ends, &mut own).zip(received) {
            let Some(pair) = self.pairs[end.pair].as_ref().filter(|_| end.multiplier && !own.is_empty())
            else {
                own.clear();
                continue;
            };
            let n = pair.rows.len();
            let factor = task.from.rigid_factor(task.scene.case, end.pair, 1 - pair.multiplier);
            for (j, own) in own.iter_mut().enumerate() {
                *own += other.get(j).copied().unwrap_or(0.0) + factor * pair.rigid_motion[n + j];
            }
        }
        own
    }

    /// Per end, the coefficients of each normal row of pairs where they vary with the temperature; empty elsewhere, and if no pair's do.
    /// They are those of the mean of the temperatures of both surfaces, or of that of the one that has one. `temperatures`: at the nodes of each end's surface,
    /// K. Collective on the roots.
    pub(super) fn coefficients(
        &self,
        scene: &Scene,
        temperatures: &[Option<Vec<f64>>],
    ) -> Vec<Vec<Coefficients>> {
        let Scene { case, exchange, .. } = *scene;
        if !case.contacts.iter().any(|contact| contact.over_temperature.is_some()) {
            return Vec::new();
        }
        let own = |(end, temperatures): (&End, &Option<Vec<f64>>)| -> Vec<f64> {
            let varies = case.contacts[end.pair].over_temperature.is_some();
            let pair = self.pairs[end.pair].as_ref().filter(|_| varies);
            let (Some(pair), Some(temperatures)) = (pair, temperatures) else { return Vec::new() };
            let at = |row: &Row| match end.multiplier {
                true => temperatures[row.node as usize],
                false => mean(row, temperatures),
            };
            pair.rows.iter().map(at).collect()
        };
        let own: Vec<Vec<f64>> = std::iter::zip(&self.shares.ends, temperatures).map(own).collect();
        let received = exchange.swap(&own);
        let of_end = |((end, own), other): ((&End, &Vec<f64>), &Vec<f64>)| -> Vec<Coefficients> {
            let property = case.contacts[end.pair].over_temperature.as_ref().filter(|_| end.multiplier);
            let (Some(property), Some(pair)) = (property, &self.pairs[end.pair]) else { return Vec::new() };
            let of_row = |j: usize| {
                let sides = [own, other].into_iter().filter_map(|side| side.get(j));
                let (sum, n) = sides.fold((0.0, 0.0), |(sum, n), t| (sum + t, n + 1.0));
                let value = property.at(sum / n);
                match pair.law {
                    Law::Tresca { .. } => [0.0, value],
                    _ => [value, 0.0],
                }
            };
            (0..pair.rows.len()).map(of_row).collect()
        };
        std::iter::zip(&self.shares.ends, &own).zip(&received).map(of_end).collect()
    }

    /// The forces of what is known, on this rank's row vector but for springs.
    pub(super) fn known_forces(&self, known: &[Vec<Option<NodeState>>]) -> Vec<f64> {
        let of_end = |(end, known): (&End, &Vec<Option<NodeState>>)| {
            let mut forces: Vec<f64> = known.iter().map(|node| node.map_or(0.0, |node| node.force)).collect();
            if self.pairs[end.pair].as_ref().is_some_and(|pair| pair.law.is_frictional()) {
                forces.extend(known.iter().map(|node| node.map_or(0.0, |node| node.tangential)));
            }
            forces
        };
        std::iter::zip(&self.shares.ends, known).flat_map(of_end).collect()
    }

    /// The states of what is known, end by end on the normal rows.
    pub(super) fn known_states(&self, known: &[Vec<Option<NodeState>>]) -> Vec<Vec<Touch>> {
        let of_end = |known: &Vec<Option<NodeState>>| {
            known.iter().map(|node| node.map_or(Touch::Open, |node| node.status)).collect()
        };
        known.iter().map(of_end).collect()
    }
}

/// The mean of values at the nodes of the mortar side, weighted as in a row.
fn mean(row: &Row, values: &[f64]) -> f64 {
    let weighted = |(sum, all): (f64, f64), (node, v): &(u32, [f64; 3])| {
        let weight = dot(v, &row.normal);
        (sum + weight * values[*node as usize], all + weight)
    };
    let (sum, all) = row.terms[1].iter().fold((0.0, 0.0), weighted);
    sum / all
}
