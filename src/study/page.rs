//! The page about a study, in Markdown, and what is printed at its end.
use super::front::{Point, cheapest, name, named_with_ties, percent, points, seconds, sentence};
use super::quantity::{is_part, norm, spoken};
use super::reference::Reference;
use super::richardson::{Behaviour, LOWEST_ORDER, Limit};
use super::table::{ROUND_OFF, Row, Table};
use crate::vector::smaller;
use std::fmt::Write;

/// Accuracies that the page names the cheapest run for, relative.
const TARGETS: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];

/// Largest over smallest time of a run from which on the times are not to be trusted.
const SCATTER: f64 = 2.0;

/// Change on the finest level from which on a quantity may have no limit: a pressure that grows with the logarithm of the cell
/// changes by several per cent from level to level, one with a power of it by more.
const WITHOUT_LIMIT: f64 = 1e-2;

/// What the page is about.
pub(super) struct Page<'a> {
    pub title: &'a str,
    /// The command that makes it.
    pub command: &'a str,
    /// File name of the picture beside it.
    pub picture: String,
    pub table: &'a Table,
    /// The quantity that accuracy is judged by; none if there is no number to judge by.
    pub quantity: Option<&'a str>,
}

impl Page<'_> {
    /// As Markdown.
    pub fn markdown(&self) -> String {
        let mut page = format!("# {}: what accuracy costs\n\n", self.title);
        let _ = write!(
            page,
            "Written by `{}`, kontakt {}{}.\n\n",
            self.command,
            env!("CARGO_PKG_VERSION"),
            machine()
        );
        if let Some(quantity) = self.quantity {
            let what = spoken(quantity, self.table.has_several_pairs());
            let _ =
                write!(page, "**{}**\n\n![Error of {what} over time]({})\n\n", self.answer(), self.picture);
            page.push_str(&self.targets(quantity, &what));
        }
        page.push_str(&self.runs());
        page.push_str(&self.quantities());
        let warnings = self.warnings();
        if !warnings.is_empty() {
            page.push_str("## Mind\n\n");
            warnings.iter().for_each(|warning| page.extend(["- ", warning, "\n"]));
        }
        page
    }

    /// The sentence.
    pub fn answer(&self) -> String {
        match self.quantity {
            Some(quantity) => sentence(self.table, quantity),
            None => "No run has a number to judge by.".into(),
        }
    }

    fn targets(&self, quantity: &str, what: &str) -> String {
        let points = points(self.table, quantity);
        let mut text = format!(
            "| error of {what} at most | cheapest run | unknowns | time | CPU | memory |\n|---|---|---|---|---|---|\n"
        );
        let mut before: Option<&Row> = None;
        for target in TARGETS {
            let Some((Point { row, .. }, tied)) = cheapest(self.table, &points, target) else { break };
            // A run that has more than the next accuracy is named for the best it has.
            let next = cheapest(self.table, &points, target / 10.0).map(|(point, _)| point.row);
            if next.is_some_and(|next| std::ptr::eq(next, *row))
                || before.is_some_and(|b| std::ptr::eq(b, *row))
            {
                continue;
            }
            before = Some(row);
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {:.0} MB |",
                round_percent(target),
                named_with_ties(self.table, row, &tied),
                count(row.dofs()),
                seconds(row.time()),
                seconds(row.cpu.low),
                row.memory
            );
        }
        text + "\n"
    }

    /// The runs: one line each.
    fn runs(&self) -> String {
        let table = self.table;
        let estimated =
            |key: &str| table.rows.iter().any(|row| !row.number(&["error_estimate", key]).is_nan());
        let labelled = table.labels.len() > 1;
        let what = self.quantity.map(|quantity| spoken(quantity, table.has_several_pairs()));
        let mut heads = Vec::new();
        heads.extend(labelled.then(|| "choice".to_string()));
        heads.extend(["level", "unknowns", "alternations"].map(String::from));
        heads.extend(what.iter().flat_map(|what| [format!("error of {what}"), "order".into()]));
        heads.extend(estimated("contact_pressure").then(|| "estimate: pressure".to_string()));
        heads.extend(estimated("energy").then(|| "estimate: energy".to_string()));
        heads.extend(["time", "from .. to", "CPU", "memory"].map(String::from));
        let mut text = format!("## Runs\n\n| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
        for row in &table.rows {
            let mut cells = Vec::new();
            cells.extend(labelled.then(|| table.labels[row.choice].clone()));
            cells.push(row.level.to_string());
            cells.push(count(row.dofs()));
            if !row.converged {
                cells.push(format!("**{}**", row.ending));
                cells.resize(heads.len() - 4, "–".into());
            } else {
                cells.push(count(row.summary["alternations"].as_u64()));
                if let Some(quantity) = self.quantity {
                    cells.push(row.errors.get(quantity).map_or("–".into(), |error| percent(*error)));
                    cells.push(row.orders.get(quantity).map_or("–".into(), |order| format!("{order:.1}")));
                }
                let keys = ["contact_pressure", "energy"].into_iter().filter(|key| estimated(key));
                cells.extend(keys.map(|key| percent(row.number(&["error_estimate", key]))));
            }
            let starved = if row.starved() { "*" } else { "" };
            cells.push(format!("{}{starved}", seconds(row.time())));
            cells.push(format!("{} .. {}", seconds(row.process.low), seconds(row.process.high)));
            cells.push(seconds(row.cpu.low));
            cells.push(if row.memory.is_nan() { "–".into() } else { format!("{:.0} MB", row.memory) });
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        let start_up = table.start_up().map_or_else(String::new, |s| {
            format!(", the {} in which MPI and the program start included", seconds(s))
        });
        let _ = write!(
            text,
            "\nTime: wall seconds of the process{start_up}, the least of the repetitions, for other work on the machine only adds \
             to it; with * the processor seconds of a rank, where the run waited for its turn. From .. to: wall seconds of the \
             repetitions. CPU: processor seconds of all processes of the run, the least. Memory: peak, all ranks. Level n: every \
             element of the case's mesh split into four, n times. Order: of the error, from the level before.\n\n"
        );
        text
    }

    /// What every quantity is measured against, and its orders.
    fn quantities(&self) -> String {
        let table = self.table;
        if table.names.is_empty() {
            return String::new();
        }
        let order =
            |label: &String| if label.is_empty() { "order".into() } else { format!("order: {label}") };
        let orders: Vec<String> = table.labels.iter().map(order).collect();
        let mut text = format!(
            "## Quantities\n\n| quantity | reference | from | smallest error | {} |\n|---|---|---|---|{}\n",
            orders.join(" | "),
            "---|".repeat(orders.len())
        );
        for name in self.shown() {
            let reference = &table.references[name];
            let smallest = table
                .rows
                .iter()
                .filter_map(|row| row.errors.get(name))
                .copied()
                .fold(f64::INFINITY, smaller);
            let order = |choice| self.order(name, choice, reference).unwrap_or("–".into());
            let orders: Vec<String> = (0..table.labels.len()).map(order).collect();
            let from = match (&reference.limit, reference.exact) {
                (_, true) => "exact".to_string(),
                (Some((choice, limit)), false) => {
                    let label = &table.labels[*choice];
                    let of = if label.is_empty() { String::new() } else { format!(" of {label}") };
                    format!("limit{of}, ± {}", percent(limit.uncertainty))
                }
                (None, false) => "–".into(),
            };
            let _ = writeln!(
                text,
                "| {name} | {} {} | {from} | {} | {} |",
                vector(&reference.values),
                reference.unit,
                percent(smallest),
                orders.join(" | ")
            );
        }
        text.push_str(
            "\nExact: by the case's `[exact]`. Limit: Richardson extrapolation of the finest three levels. Order: at the finest \
             levels, of the errors where the reference is exact, else of the differences from level to level.\n",
        );
        text + "\n"
    }

    /// The quantities that the page is about: of vectors the whole, and a component only if accuracy is judged by it.
    fn shown(&self) -> impl Iterator<Item = &String> {
        self.table.names.iter().filter(|name| !is_part(name) || self.quantity == Some(name.as_str()))
    }

    /// Order of a quantity for a choice: of the errors, or of the differences where the reference is a limit.
    fn order(&self, name: &str, choice: usize, reference: &Reference) -> Option<String> {
        let order = match reference.exact {
            true => self.table.curve(choice).last()?.orders.get(name).copied(),
            false => self.table.limits.get(&(name.to_string(), choice))?.order,
        };
        order.map(|order| format!("{order:.1}"))
    }

    /// What should not be believed without a second look.
    pub fn warnings(&self) -> Vec<String> {
        let table = self.table;
        let mut warnings = Vec::new();
        for row in table.rows.iter().filter(|row| !row.converged) {
            let error = row.error_text.as_ref().map_or_else(String::new, |error| format!(": {error}"));
            warnings.push(format!("{}: {}{error}; not in the curves.", name(table, row), row.ending));
        }
        let of_rows = |rows: usize| format!("{rows} of {} rows", table.rows.len());
        let scattered = table.rows.iter().filter(|row| row.process.high > SCATTER * row.process.low).count();
        if scattered > 0 {
            warnings.push(format!(
                "The times of {} scatter by more than a factor of {SCATTER}: the machine had other work. The least of them counts; \
                 `--fresh` measures again.",
                of_rows(scattered)
            ));
        }
        let starved = table.rows.iter().filter(|row| row.starved()).count();
        if starved > 0 {
            warnings.push(format!(
                "The runs of {} waited for the machine longer than they worked: their processor seconds stand for their time.",
                of_rows(starved)
            ));
        }
        let unresolved = table.unresolved();
        if let Some((row, pair)) = unresolved.first() {
            warnings.push(format!(
                "{}: fewer than {} nodes of {pair} are in contact ({} in all): what happens there depends on the mesh, and no \
                 limit is taken from such levels.",
                name(table, row),
                crate::record::RESOLVED_NODES,
                of_rows(unresolved.len())
            ));
        }
        for quantity in self.shown() {
            let reference = &table.references[quantity];
            let Some((choice, limit)) = &reference.limit else { continue };
            if let Some((other, away)) = reference.conflict {
                warnings.push(format!(
                    "{quantity}: the limits of {} and {} contradict each other: they are {} apart, more than both claim; the \
                     reference, that of {}, is known to {} at best.",
                    table.labels[*choice],
                    table.labels[other],
                    percent(away),
                    table.labels[*choice],
                    percent(reference.known_to)
                ));
            }
            if reference.exact {
                if reference.known_to > 0.0 {
                    warnings.push(format!(
                        "{quantity}: the finest levels tend to {}, the exact value is {}: they differ by {}. Either the closed form \
                         holds no better than that, or finer levels are needed; smaller errors say nothing.",
                        vector(&limit.values),
                        vector(&reference.values),
                        percent(reference.known_to)
                    ));
                }
            } else if let Some(text) = not_asymptotic(limit) {
                let of = &table.labels[*choice];
                let of = if of.is_empty() { String::new() } else { format!(" ({of})") };
                warnings.push(format!(
                    "{quantity}{of}: {text}; the reference is known to {} at best.",
                    percent(limit.uncertainty)
                ));
            }
        }
        warnings
    }
}

/// What is wrong with a limit, if anything is.
fn not_asymptotic(limit: &Limit) -> Option<String> {
    let order = limit.order.unwrap_or(f64::NAN);
    match limit.behaviour {
        Behaviour::Asymptotic | Behaviour::Settled => None,
        Behaviour::Oscillating => {
            Some("the finest levels oscillate, the last one stands for the limit".into())
        }
        Behaviour::Slow if limit.change > WITHOUT_LIMIT => Some(format!(
            "not asymptotic: order {order:.1} on the finest levels, below {LOWEST_ORDER}; it may have no limit, as at a sharp \
             corner, and the finest level stands for it"
        )),
        Behaviour::Slow => Some(format!(
            "not asymptotic: the finest levels differ by {} only, but by no less than those before; the finest one stands for \
             the limit",
            percent(limit.change)
        )),
        Behaviour::Erratic => Some(format!(
            "not asymptotic: order {order:.1} on the finest levels, and another one on those before; finer levels are needed"
        )),
        Behaviour::Fast => Some(format!(
            "not asymptotic: order {order:.1} on the finest levels, more than the elements have; finer levels are needed"
        )),
    }
}

/// A number, or the components of a vector, those that are round-off as 0.
fn vector(values: &[f64]) -> String {
    let scale = norm(values);
    let text =
        |value: &f64| if value.abs() < ROUND_OFF * scale { "0".into() } else { format!("{value:.6e}") };
    let texts: Vec<String> = values.iter().map(text).collect();
    if texts.len() > 1 { format!("({})", texts.join(", ")) } else { texts.join("") }
}

/// A power of ten in percent: 0.1 %.
fn round_percent(target: f64) -> String {
    let decimals = (-(100.0 * target).log10().round()).max(0.0) as usize;
    format!("{:.decimals$} %", 100.0 * target)
}

/// 38104 as `38 104`.
fn count(value: Option<u64>) -> String {
    let Some(value) = value else { return "–".into() };
    let digits = value.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    groups.join("\u{a0}")
}

/// `, on 2 cores of NAME`, where the system says so.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    match model {
        Some((_, model)) => format!(", on {cores} cores of {}", model.trim()),
        None => format!(", on {cores} cores"),
    }
}
