//! What goes along the path.
use super::{contacts::Contacts, neutral::Neutral, place::Place, task::Modes};
use crate::body::{Body, Response};

/// The bodies of this rank's group with their factorisations, and the contact rows as its first rank holds them. What it
/// keeps between steps can be made again from a state: operators, and the contact rows of the last geometry.
pub(crate) struct Engine {
    pub(super) bodies: Vec<Body>,
    pub(super) responses: Vec<Response>,
    pub(super) contacts: Option<Contacts>,
    pub(super) modes: Modes,
    /// Motions of this rank's bodies along their own surfaces.
    pub(super) neutral: Vec<Neutral>,
    /// The geometry that the rows are of; `None`: not known.
    pub(super) rows_at: Option<Place>,
    pub clock: Clock,
}

/// Seconds that this rank has spent, waiting for others included.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Clock {
    /// Search and transfer.
    pub search: f64,
    /// From the assembled matrices to the bodies' answers on the contact rows.
    pub factorise: f64,
    /// Load steps: the driver, then the displacements of the whole bodies.
    pub step: f64,
    /// Of these the displacements.
    pub recover: f64,
}

/// What a step leaves for each body: contact nodal forces and displacements at the owned nodes.
#[derive(Clone, Default)]
pub(crate) struct Nodal {
    pub contact: Vec<Vec<f64>>,
    pub displacement: Vec<Vec<f64>>,
}
