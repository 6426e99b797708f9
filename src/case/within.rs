//! Reads `within`: a box with sides along the axes.
use super::reader::Fields;

/// The box `within`.
pub(super) fn within(fields: &Fields<'_>) -> Option<[[f64; 3]; 2]> {
    let table = fields.table("within")?;
    let mut limits = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
    if table.given(&["x", "y"]).is_empty() {
        table.error("names no direction; give x = [from, to] or y = [from, to]");
    }
    for (axis, key) in ["x", "y"].into_iter().enumerate() {
        match table.numbers(key).as_deref() {
            Some([low, high]) if low <= high => (limits[0][axis], limits[1][axis]) = (*low, *high),
            Some(_) => table.error_at(key, "two numbers are needed, the smaller first"),
            None => {}
        }
    }
    Some(limits)
}
