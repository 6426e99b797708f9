//! Which facets and nodes a named region of the case means.
pub use crate::case::Region;
use crate::{
    case::Origin,
    error::Result,
    mesh::{Facet, Mesh},
};

/// Diagonal of the points' bounding box, m.
pub fn mesh_extent(points: &[[f64; 3]]) -> f64 {
    let mut extent: f64 = 0.0;
    for c in 0..3 {
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[c]), high.max(p[c])));
        if high > low {
            extent = extent.hypot(high - low);
        }
    }
    extent
}

/// Facets of a named surface, or of its part inside a box; an error names the surfaces there are.
pub fn find_facets(
    mesh: &Mesh,
    body: &str,
    name: &str,
    within: Option<&[[f64; 3]; 2]>,
    origin: &Origin,
) -> Result<Vec<Facet>> {
    let Some(facets) = mesh.surfaces.get(name) else {
        let nearest = mesh
            .surfaces
            .keys()
            .map(|known| (strsim::damerau_levenshtein(known, name), known))
            .min()
            .map_or(String::new(), |(_, known)| format!("; nearest: \"{known}\""));
        let all: Vec<&str> = mesh.surfaces.keys().map(String::as_str).collect();
        return Err(origin.error(format!(
            "body '{body}' has no surface \"{name}\"{nearest} (it has: {})",
            if all.is_empty() { "none".into() } else { all.join(", ") }
        )));
    };
    let Some([low, high]) = within else { return Ok(facets.clone()) };
    let tolerance = 1e-9 * mesh_extent(&mesh.points);
    let inside = |node: u32| {
        let x = &mesh.points[node as usize];
        (0..3).all(|c| x[c] >= low[c] - tolerance && x[c] <= high[c] + tolerance)
    };
    let part: Vec<Facet> = facets.iter().copied().filter(|&f| mesh.facet_nodes(f).all(inside)).collect();
    if part.is_empty() {
        return Err(
            origin.error(format!("no facet of surface \"{name}\" of body '{body}' lies inside the box"))
        );
    }
    Ok(part)
}

/// The node at a point.
pub fn find_node(mesh: &Mesh, body: &str, point: &[f64; 3], origin: &Origin) -> Result<u32> {
    let d2 = |p: &[f64; 3]| (0..3).map(|c| (p[c] - point[c]).powi(2)).sum::<f64>();
    let (node, distance) = mesh
        .points
        .iter()
        .enumerate()
        .map(|(i, p)| (i, d2(p).sqrt()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or_else(|| origin.error(format!("body '{body}' has no nodes")))?;
    if distance <= 1e-6 * mesh_extent(&mesh.points) {
        return Ok(node as u32);
    }
    let p = mesh.points[node];
    Err(origin.error(format!(
        "body '{body}' has no node at ({}, {}); the nearest is at ({}, {})",
        point[0], point[1], p[0], p[1]
    )))
}

/// Nodes of a region.
pub fn find_nodes(mesh: &Mesh, body: &str, region: &Region, origin: &Origin) -> Result<Vec<u32>> {
    match region {
        Region::Point(x) => Ok(vec![find_node(mesh, body, x, origin)?]),
        Region::Surface { name, within } => {
            let facets = find_facets(mesh, body, name, within.as_ref(), origin)?;
            let mut nodes: Vec<u32> = facets.iter().flat_map(|&f| mesh.facet_nodes(f)).collect();
            nodes.sort_unstable();
            nodes.dedup();
            Ok(nodes)
        }
    }
}
