//! History as one value.
use crate::{body::LoadFactors, contact::Coefficients, material::PointState, schwarz::Touch};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// One accepted point of the load path, as far as this rank holds it: all that a next step needs to know of the steps
/// before. Its keys (bodies, pairs and sides of the case, nodes of the meshes) do not depend on the number of ranks; the
/// states of all ranks, [joined](State::join), are that of the case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// What acts.
    pub factors: LoadFactors,
    /// Bodies of this rank, with the nodes it owns.
    pub bodies: Vec<BodyState>,
    /// Sides with multipliers that this rank holds.
    pub pairs: Vec<PairState>,
    /// Of all bodies; nought where nothing rubs or yields.
    #[serde(default)]
    pub energy: Energy,
}

/// Energies of all bodies since the start, J.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Work of loads and supports, and of putting together surfaces that overlap at the start.
    pub external: f64,
    /// What heat has changed of the elastic energy.
    pub heat: f64,
    /// Elastic energy.
    pub stored: f64,
    /// Work of friction.
    pub dissipated: f64,
    /// Plastic work.
    #[serde(default)]
    pub plastic: f64,
    /// The largest of these so far.
    pub largest: f64,
}

/// A body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// Index in the case.
    pub body: usize,
    /// Mesh nodes.
    pub nodes: Vec<u32>,
    /// Their displacements, m, one after the other, as many components as the mesh has dimensions.
    pub displacement: Vec<f64>,
    /// Mesh cells whose points are known, of a body that yields: of several ranks, some twice.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cells: Vec<u32>,
    /// Where the points of each end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<u32>,
    /// Their points, one cell after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointState>,
}

/// The side of a contact pair that carries the multipliers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PairState {
    /// Index of the pair in the case.
    pub pair: usize,
    /// Side in the case: 0 is A.
    pub side: usize,
    /// Its candidates, and open those that have been candidates and are none any more.
    pub nodes: Vec<NodeState>,
    /// Work of friction in all, J.
    pub dissipated: f64,
}

/// A contact node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NodeState {
    /// Mesh node.
    pub node: u32,
    /// Compressive force, N.
    pub force: f64,
    /// Tangential force, N: on the side of the multipliers against its outward normal turned forwards.
    pub tangential: f64,
    /// Gap, m.
    pub gap: f64,
    /// How far it has slipped in all, m: this side against the other along the normal turned forwards.
    pub slip: f64,
    /// What it does.
    pub status: Touch,
    /// Where those of its law vary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<Coefficients>,
}

impl State {
    /// Before any step: nothing acts, nothing has moved, nothing is known of the contact.
    pub fn start() -> State {
        State { factors: LoadFactors::NONE, bodies: Vec::new(), pairs: Vec::new(), energy: Energy::default() }
    }

    /// Takes in another rank's share of the same point.
    pub fn join(&mut self, other: State) {
        self.bodies.extend(other.bodies);
        self.pairs.extend(other.pairs);
    }

    /// Nodes by pair, side and mesh node.
    pub(super) fn nodes(pairs: &[PairState]) -> HashMap<(usize, usize, u32), NodeState> {
        let of = |pair: &PairState| {
            let key = (pair.pair, pair.side);
            pair.nodes.iter().map(move |n| ((key.0, key.1, n.node), *n)).collect::<Vec<_>>()
        };
        pairs.iter().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A restart goes on where the paths are; a state of a case without paths needs to say nothing of them.
    #[test]
    fn a_state_carries_the_factors_of_all_paths() {
        let factors = LoadFactors { loads: 0.5, at: 1.5, paths: vec![0.25, -1.0], ..LoadFactors::NONE };
        let state = State { factors, ..State::start() };
        let text = serde_json::to_string(&state).unwrap();
        assert_eq!(serde_json::from_str::<State>(&text).unwrap(), state);
        let plain = text.replace(",\"at\":1.5,\"paths\":[0.25,-1.0]", "");
        let read: State = serde_json::from_str(&plain).unwrap();
        assert!(plain != text && read.factors == LoadFactors { loads: 0.5, ..LoadFactors::NONE });
    }
}
