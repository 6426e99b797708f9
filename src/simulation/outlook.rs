//! What a run would do and cost, before it is done.
use crate::{
    body::{Constraints, condense_estimate, free_motions},
    case::{Case, Driver, ResponseCase},
    error::Result,
    parallel::agree,
};
use crate::{
    scene::Plan,
    step::{Contacts, gather_lines},
};

/// Lines on bodies and contacts: unknowns, ranks, effects, what supports leave free, and how each body would answer contact
/// at which cost. Finds the contact rows, but assembles and solves nothing. Collective; the lines are on every rank.
pub fn outlook(case: &Case, plan: &Plan) -> Result<Vec<String>> {
    let groups = &plan.groups;
    let exchange = plan.exchange(case);
    let contacts = match groups.is_root() {
        true => Contacts::new(case, plan, &exchange).map(Some),
        false => Ok(None),
    };
    let contacts = agree(&groups.world, contacts)?;
    let described = if groups.is_root() { bodies(case, plan, contacts.as_ref()) } else { Ok(Vec::new()) };
    let mut lines = agree(&groups.world, described)?;
    if let Some(contacts) = &contacts {
        lines.extend(contacts.outlook(case));
        lines.extend(contacts.overlaps(case, plan).into_iter().map(|line| format!("warning: {line}")));
    }
    let mut lines = gather_lines(&groups.world, &lines);
    // Bodies before contacts, each in the order of the ranks.
    lines.sort_by_key(|line| !line.starts_with("body"));
    Ok(lines)
}

fn bodies(case: &Case, plan: &Plan, contacts: Option<&Contacts>) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    for (i, &b) in plan.groups.bodies().iter().enumerate() {
        let (body, mesh, dofs) = (&case.bodies[b], &plan.meshes[i], plan.dofs[b]);
        let ranks = plan.groups.shares[plan.groups.own].ranks.len();
        let heat = if body.temperature.is_some() { ", thermal strain" } else { "" };
        let mut line = format!("body {}: {dofs} dofs on {ranks} rank(s){heat}", body.name);
        let interface = contacts.map_or(0, |c| c.interface_nodes(i)) * mesh.dim;
        if interface > 0 {
            let estimate = condense_estimate(dofs, interface, mesh.dim);
            // A solver of the user's choice is used.
            let own = body.solver.as_ref().is_some_and(|s| s.contains("-ksp_type") || s.contains("-pc_type"));
            let chosen = match body.response {
                _ if matches!(case.alternation.driver, Driver::Relaxed(_)) => "condensed",
                ResponseCase::Automatic if estimate.prefers_condensed() && !own => "condensed",
                ResponseCase::Automatic | ResponseCase::Solver => "by its solver",
                ResponseCase::Condensed => "condensed",
            };
            line += &format!(
                "; {interface} of them on the interface, answers {chosen} (estimate: condensed {:.2} Gflop and {:.0} MB, by its \
                 solver {:.2} Gflop)",
                estimate.condensed / 1e9,
                (estimate.bytes + estimate.factor_bytes) / 1e6,
                estimate.solver / 1e9
            );
        }
        let free = free_motions(mesh, &Constraints::new(body, mesh)?);
        if !free.is_empty() {
            line += &format!("; supports leave free: {}", free.join(", "));
        }
        lines.push(line);
    }
    Ok(lines)
}
