//! What a body that answers by its solver is made of.
use super::{
    Body, Fixing, FreeModes, Interface, assembly::Model, cost::SharedCost, row_values::RowValues,
    system::System,
};
use std::rc::Rc;

/// The body, but for its loads, and its rows.
pub(super) struct Parts {
    pub values: RowValues,
    pub model: Rc<Model>,
    pub temperature: Option<Rc<Vec<f64>>>,
    pub interface: Rc<Interface>,
    pub free: Rc<FreeModes>,
    pub fixings: Rc<Vec<Fixing>>,
    pub system: Rc<System>,
    pub cost: SharedCost,
}

impl Parts {
    pub fn new(body: &Body, values: RowValues) -> Parts {
        Parts {
            values,
            model: body.model.clone(),
            temperature: body.temperature.clone(),
            interface: body.interface.clone(),
            free: body.free.clone(),
            fixings: body.fixings.clone(),
            system: body.system.clone(),
            cost: body.cost.clone(),
        }
    }
}
