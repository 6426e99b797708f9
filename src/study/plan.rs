//! What a study runs: every sensible combination of what is listed, at every level.
use super::request::Request;
use crate::{
    Error, Result,
    case::{self, Case, Driver, Geometry, StudyCase, Tolerance},
    scene::build_mesh,
};

/// Seconds of a run without unknowns: start-up of MPI, libraries, files and pictures.
const START_UP: f64 = 0.6;
/// Seconds for each unknown of a plane problem, about; only to say beforehand how long a study may take.
const SECONDS_PER_DOF: f64 = 15e-6;
/// Unknowns at a node of a plane problem.
const DOFS_PER_NODE: f64 = 2.0;
/// A level has this many times the elements of the one before.
const GROWTH: f64 = 4.0;

/// One way of solving the case; `None`: as the case has it.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub(super) struct Choice {
    pub element: Option<String>,
    pub driver: Option<String>,
    /// As written in a case file.
    pub weights: Option<String>,
    pub transfer: Option<String>,
    /// As written in a case file.
    pub tolerance: Option<String>,
    pub response: Option<String>,
    pub solver: Option<String>,
    pub ranks: usize,
}

impl Choice {
    /// Settings that are none of kontakt's defaults.
    pub fn departures(&self) -> usize {
        let departs = |value: &Option<String>, default: &str| {
            value.as_ref().is_some_and(|value| value.trim_matches('"') != default)
        };
        let settings = [
            departs(&self.element, "quad4"),
            departs(&self.driver, "active set"),
            departs(&self.weights, "response"),
            departs(&self.transfer, "mortar"),
            departs(&self.tolerance, "auto"),
            departs(&self.response, "automatic"),
            departs(&self.solver, ""),
            self.ranks != 1,
        ];
        settings.into_iter().filter(|departs| *departs).count()
    }
}

/// A run of the study, apart from its repetitions.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Index into [`Plan::choices`].
    pub choice: usize,
    pub level: usize,
    /// Changes to the case.
    pub sets: Vec<String>,
    pub ranks: usize,
    /// Unknowns expected.
    pub dofs: f64,
}

/// The whole study before anything is run.
pub(super) struct Plan {
    /// The case with the changes of `[study]` and of the user.
    pub case: Case,
    pub choices: Vec<Choice>,
    /// Coarse levels first.
    pub runs: Vec<Run>,
    /// Elements of the bodies, by choice.
    pub elements: Vec<Elements>,
}

/// The elements of a choice.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Elements {
    /// Names of the kinds.
    pub names: String,
    /// Largest order of their shape functions.
    pub degree: usize,
    /// Unknowns on the case's own mesh.
    pub dofs: f64,
}

impl Run {
    /// Its name in the journal: all that makes it another run than the others.
    pub fn id(&self) -> String {
        format!("{} ranks, {}", self.ranks, self.sets.join("; "))
    }

    /// Seconds it may take.
    pub fn guess(&self) -> f64 {
        START_UP + SECONDS_PER_DOF * self.dofs
    }
}

impl Plan {
    /// Reads the case and every combination of it, so that wrong ones are refused before any is run.
    pub fn new(request: &Request) -> Result<Plan> {
        let read = |sets: &[String]| case::read(&request.case, request.variant.as_deref(), sets);
        // The study's own changes come before the user's.
        let asked: Vec<String> = [&request.sets[..], &request.flags[..]].concat();
        let own = read(&asked)?.study.sets;
        let sets = [own, request.sets.clone()].concat();
        let case = read(&[&sets[..], &request.flags[..]].concat())?;
        let study = case.study.clone();
        refuse(&case, &study)?;
        refuse_ranks(&study, request.oversubscribe)?;
        let choices = choices(&case, &study)?;
        let (mut runs, mut all_elements) = (Vec::new(), Vec::new());
        for (choice, choice_of) in choices.iter().enumerate() {
            let coarsest = [&sets[..], &changes(&case, choice_of, 0)[..]].concat();
            let elements = elements(&read(&coarsest)?)?;
            for &level in &study.levels {
                let sets = [&sets[..], &changes(&case, choice_of, level)[..]].concat();
                let dofs = elements.dofs * GROWTH.powi(level as i32);
                runs.push(Run { choice, level, sets, ranks: choice_of.ranks, dofs });
            }
            all_elements.push(elements);
        }
        // A level that no mesh can have.
        if let Some(finest) = runs.iter().max_by_key(|run| run.level) {
            read(&finest.sets)?;
        }
        runs.sort_by_key(|run| (run.level, run.choice));
        Ok(Plan { case, choices, runs, elements: all_elements })
    }

    /// Names of the choices: what tells them apart.
    pub fn labels(&self) -> Vec<String> {
        let mut labels = vec![Vec::new(); self.choices.len()];
        let columns: [fn(&Choice) -> Option<String>; 8] = [
            |c| c.element.clone(),
            |c| c.driver.clone(),
            |c| Some(format!("weights {}", c.weights.as_ref()?.trim_matches('"'))),
            |c| c.transfer.clone(),
            |c| Some(format!("tolerance {}", c.tolerance.as_ref()?.trim_matches('"'))),
            |c| Some(format!("response {}", c.response.as_ref()?)),
            |c| {
                c.solver
                    .as_ref()
                    .map(|options| if options.is_empty() { "default solver" } else { options }.into())
            },
            |c| Some(format!("{} rank{}", c.ranks, if c.ranks == 1 { "" } else { "s" })),
        ];
        for column in columns {
            let values: Vec<Option<String>> = self.choices.iter().map(column).collect();
            if values.iter().any(|value| *value != values[0]) {
                for (label, value) in labels.iter_mut().zip(values) {
                    label.extend(value);
                }
            }
        }
        labels.into_iter().map(|parts: Vec<String>| parts.join(", ")).collect()
    }

    /// Runs with repetitions, and the seconds they may take together.
    pub fn size(&self) -> (usize, f64) {
        let repeat = self.case.study.repeat;
        let seconds: f64 = self.runs.iter().map(Run::guess).sum();
        (self.runs.len() * repeat, seconds * repeat as f64)
    }
}

/// What cannot be studied.
fn refuse(case: &Case, study: &StudyCase) -> Result<()> {
    if case.exact.is_none() && study.levels.len() < 3 {
        return Err(Error::input(format!(
            "study.levels: {:?} was given; without an [exact] entry errors are measured against the limit of the finest \
             levels, which takes at least three",
            study.levels
        )));
    }
    if let (Some(element), Some(body)) = (
        study.elements.first(),
        case.bodies.iter().find(|body| matches!(body.geometry, Geometry::Gmsh { .. })),
    ) {
        return Err(body.origin.error(format!(
            "study.elements asks for {element}, but the mesh of body '{}' is a file, which has its own elements",
            body.name
        )));
    }
    Ok(())
}

/// More ranks than cores measure how they wait for each other, and a slip of the pen starts a thousand processes.
fn refuse_ranks(study: &StudyCase, forced: bool) -> Result<()> {
    let cores = cores();
    match study.ranks.iter().max() {
        Some(&most) if most > cores && !forced => Err(Error::input(format!(
            "study.ranks: {most} was given; this machine has {cores} cores for the study (--oversubscribe runs it nevertheless)"
        ))),
        _ => Ok(()),
    }
}

/// Cores that this process may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn choices(case: &Case, study: &StudyCase) -> Result<Vec<Choice>> {
    let mut choices = Vec::new();
    let all = Choice {
        element: None,
        driver: None,
        weights: None,
        transfer: None,
        tolerance: None,
        response: None,
        solver: None,
        ranks: 1,
    };
    let mut all = vec![all];
    vary(&mut all, &some(&study.drivers), |choice, driver| choice.driver = driver);
    vary(&mut all, &some(&study.weights), |choice, weights| choice.weights = weights);
    vary(&mut all, &some(&study.transfers), |choice, transfer| choice.transfer = transfer);
    vary(&mut all, &some(&study.elements), |choice, element| choice.element = element);
    vary(&mut all, &some(&study.tolerances), |choice, tolerance| choice.tolerance = tolerance);
    vary(&mut all, &some(&study.responses), |choice, response| choice.response = response);
    vary(&mut all, &some(&study.solvers), |choice, solver| choice.solver = solver);
    vary(&mut all, &study.ranks, |choice, ranks| choice.ranks = ranks);
    for mut choice in all {
        if !is_relaxed(case, &choice) {
            choice.weights = None;
        }
        if !choices.contains(&choice) {
            choices.push(choice);
        }
    }
    if !study.weights.is_empty() && choices.iter().all(|choice| choice.weights.is_none()) {
        return Err(Error::input(
            "study.weights: weights belong to the driver \"relaxed\", which no run has",
        ));
    }
    Ok(choices)
}

/// The values, or none of them.
fn some(values: &[String]) -> Vec<Option<String>> {
    if values.is_empty() { vec![None] } else { values.iter().cloned().map(Some).collect() }
}

/// Every choice with every value.
fn vary<T: Clone>(choices: &mut Vec<Choice>, values: &[T], set: impl Fn(&mut Choice, T)) {
    let with = |choice: &Choice| {
        let choice = choice.clone();
        let set = &set;
        values.iter().map(move |value| {
            let mut choice = choice.clone();
            set(&mut choice, value.clone());
            choice
        })
    };
    *choices = choices.iter().flat_map(|choice| with(choice).collect::<Vec<_>>()).collect();
}

fn is_relaxed(case: &Case, choice: &Choice) -> bool {
    match &choice.driver {
        Some(driver) => driver == "relaxed",
        None => matches!(case.alternation.driver, Driver::Relaxed(_)),
    }
}

/// The changes that make a choice at a level of the case.
fn changes(case: &Case, choice: &Choice, level: usize) -> Vec<String> {
    let mut sets = alternation(case, choice);
    let mut set = |body: &str, key: &str, value: String| sets.push(format!("body.{body}.{key}={value}"));
    for body in &case.bodies {
        if level > 0 {
            set(&body.name, "mesh.refine", (body.refine + level).to_string());
        }
        if let Some(element) = &choice.element {
            set(&body.name, "element", format!("\"{element}\""));
        }
        if let Some(response) = &choice.response {
            set(&body.name, "response", format!("\"{response}\""));
        }
        if let Some(solver) = &choice.solver {
            set(&body.name, "solver", format!("\"{solver}\""));
        }
    }
    sets
}

/// Keys of `[alternation]`; with another driver a new table, since the old one's keys are the other's.
fn alternation(case: &Case, choice: &Choice) -> Vec<String> {
    let mut keys = Vec::new();
    let own = case.alternation.driver.name();
    let changed = choice.driver.as_deref().is_some_and(|driver| driver != own);
    if let Some(driver) = &choice.driver {
        keys.push(("driver", format!("\"{driver}\"")));
    }
    keys.extend(choice.weights.iter().map(|weights| ("weights", weights.clone())));
    keys.extend(choice.transfer.iter().map(|transfer| ("transfer", format!("\"{transfer}\""))));
    let tolerance = choice.tolerance.clone();
    let kept = changed.then(|| match case.alternation.tolerance {
        Tolerance::Fixed(value) => format!("{value:e}"),
        Tolerance::Automatic => "\"auto\"".into(),
    });
    keys.extend(tolerance.or(kept).map(|tolerance| ("tolerance", tolerance)));
    if !changed {
        return keys.into_iter().map(|(key, value)| format!("alternation.{key}={value}")).collect();
    }
    let entries: Vec<String> = keys.into_iter().map(|(key, value)| format!("{key} = {value}")).collect();
    vec![format!("alternation={{ {} }}", entries.join(", "))]
}

/// What the meshes of a case are made of.
fn elements(case: &Case) -> Result<Elements> {
    let mut elements = Elements::default();
    let mut names = Vec::new();
    for body in &case.bodies {
        let mesh = build_mesh(&body.geometry)?;
        elements.dofs += DOFS_PER_NODE * mesh.points.len() as f64;
        for cell in &mesh.cells {
            if !names.contains(&cell.kind.name()) {
                names.push(cell.kind.name());
                let degree = if cell.kind.n_nodes() > cell.kind.n_corners() { 2 } else { 1 };
                elements.degree = elements.degree.max(degree);
            }
        }
    }
    elements.names = names.join("+");
    Ok(elements)
}
