//! What is known of the contact nodes from the steps before.
use super::{
    contacts::Contacts,
    rows::turned,
    state::{NodeState, PairState, State},
    task::{Scene, Task},
};
use crate::{
    contact::{Row, vector::dot},
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
