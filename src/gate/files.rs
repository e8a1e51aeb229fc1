//! How is a program judged that cannot be driven by a pipe? Problems as files, truth kept apart, answers as
//! files.

use super::accept::{Breakage, id_in, read_line};
use super::greeting::Greeting;
use super::lines::{self, Line};
use super::plan::{Asked, Plan, PlanError, Purpose};
use super::program::MOST_LINE_BYTES;
use super::protocol::{Answer, Problem};
use super::quoted::quoted;
use super::recorder::{self, Recorder};
use super::solver::{Given, Solver};
use calibench::camera::{Model, UnknownModel};
use calibench::io::hash::sha256_hex;
use calibench::io::input::open_regular;
use calibench::io::{InputError, read_regular_text, write_atomically};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// What a folder of problems was made from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Manifest {
    seed: u64,
    samples: usize,
    /// Names of the lens models; one of Brown-Conrady's only does not say so.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    models: Vec<String>,
    /// Names of the scenes, unless all were asked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    scenes: Vec<String>,
    problems: usize,
    /// SHA-256 of `problems.jsonl`.
    sha256: String,
}

impl Manifest {
    fn asked(&self) -> Result<Asked, FilesError> {
        let models = self.models.iter().map(|name| name.parse()).collect::<Result<Vec<Model>, _>>()?;
        let models = if models.is_empty() { vec![Model::BrownConrady] } else { models };
        Ok(Asked { models, scenes: self.scenes.clone() })
    }
}

/// Bytes of a file of answers: those of ten thorough runs.
const MOST_BYTES: u64 = 1 << 32;

/// Why a folder cannot be written or judged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilesError {
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] InputError),
    /// The manifest is none.
    #[error("{path} is no manifest of an export: {cause}", path = path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: serde_json::Error,
    },
    /// This version of the gate makes other problems from the same seed.
    #[error(
        "the problems were made by another version of the gate: export them again (sha256 {found}, now {now})"
    )]
    OtherVersion {
        /// Of the manifest.
        found: String,
        /// Of the problems made now.
        now: String,
    },
    /// Answers that took somebody's time are not joined with other problems, nor replaced.
    #[error("{folder} holds answers already: name another folder, or move them away", folder = folder.display())]
    Answered {
        /// The folder.
        folder: PathBuf,
    },
    /// A lens model that there is not.
    #[error(transparent)]
    Model(#[from] UnknownModel),
    /// A plan that cannot be made.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Writes `problems.jsonl`, `manifest.json` and `truth/truth.jsonl` to a folder.
///
/// # Errors
/// A folder that holds answers; a file that cannot be written.
pub fn export(plan: &Plan, folder: &Path) -> Result<(), FilesError> {
    if answer_files(folder)?.iter().any(|file| file.exists()) {
        return Err(FilesError::Answered { folder: folder.to_path_buf() });
    }
    let problems = problem_lines(plan);
    let manifest = Manifest {
        seed: plan.seed,
        samples: plan.samples,
        models: match &plan.asked.models[..] {
            [Model::BrownConrady] => Vec::new(),
            models => models.iter().map(|model| model.name().to_string()).collect(),
        },
        scenes: plan.asked.scenes.clone(),
        problems: plan.cases.len(),
        sha256: sha256_hex(problems.as_bytes()),
    };
    write_atomically(&folder.join("problems.jsonl"), problems.as_bytes())?;
    write_atomically(&folder.join("truth/truth.jsonl"), truth_lines(plan).as_bytes())?;
    let manifest = format!("{:#}\n", serde_json::to_value(&manifest).unwrap_or_default());
    write_atomically(&folder.join("manifest.json"), manifest.as_bytes())?;
    Ok(())
}

/// Writes the answers that were kept of a run to `answers.jsonl`; a question that broke the protocol has a
/// line that says how.
///
/// # Errors
/// A file that cannot be written.
pub fn file_answers(plan: &Plan, folder: &Path, recorder: &Recorder<'_>) -> Result<(), FilesError> {
    let lines = plan.cases.iter().filter_map(|case| recorder.line(&plan.id(case)));
    write_atomically(&folder.join("answers.jsonl"), joined(lines.collect()).as_bytes())?;
    Ok(())
}

fn joined(lines: Vec<String>) -> String {
    lines.into_iter().map(|line| line + "\n").collect()
}

fn problem_lines(plan: &Plan) -> String {
    joined(plan.cases.par_iter().map(|case| plan.problem(case).to_line()).collect())
}

/// Camera and poses behind every problem; variants follow from their samples and have no line.
fn truth_lines(plan: &Plan) -> String {
    let lines = plan.cases.iter().filter(|c| !matches!(c.purpose, Purpose::Variant(_))).map(|case| {
        let (camera, poses) = match case.purpose {
            Purpose::Bad(index) => (plan.bad[index].truth, Vec::new()),
            _ => {
                let setup = plan.scenarios[case.scenario].setup_of(plan.seed, case.trial);
                (setup.scene.truth.camera, setup.scene.truth.cam_from_target.clone())
            }
        };
        let parameters: BTreeMap<&str, f64> =
            camera.values().map(|(parameter, value)| (parameter.name(), value)).collect();
        let poses: Vec<serde_json::Value> = poses
            .iter()
            .map(|pose| {
                let rows: Vec<Vec<f64>> =
                    pose.rotation.row_iter().map(|r| r.iter().copied().collect()).collect();
                serde_json::json!({"rotation": rows, "translation": pose.translation.as_slice()})
            })
            .collect();
        serde_json::json!({"id": plan.id(case), "case": plan.name(case), "parameters": parameters, "poses": poses}).to_string()
    });
    joined(lines.collect())
}

/// Answers that were given beforehand, as a solver.
#[derive(Debug)]
pub struct Recorded {
    folder: PathBuf,
    answers: BTreeMap<String, Result<Answer, Breakage>>,
    /// The first line that answers no problem of the folder, and where.
    stray: Option<String>,
}

/// The plan of a folder, and the answers in it: `answers.jsonl`, and every file in `answers/`.
///
/// A line that is no answer is a finding about its problem.
///
/// # Errors
/// A folder without a manifest or answers, or problems of another version.
pub fn recorded(folder: &Path) -> Result<(Plan, Recorded), FilesError> {
    let path = folder.join("manifest.json");
    let manifest: Manifest =
        serde_json::from_str(&read(&path)?).map_err(|cause| FilesError::Manifest { path, cause })?;
    let plan = Plan::of(manifest.seed, manifest.samples, manifest.asked()?)?;
    let now = sha256_hex(problem_lines(&plan).as_bytes());
    if now != manifest.sha256 || plan.cases.len() != manifest.problems {
        return Err(FilesError::OtherVersion { found: manifest.sha256, now });
    }
    let asked: BTreeSet<String> = plan.cases.iter().map(|case| plan.id(case)).collect();
    let mut recorded = Recorded { folder: folder.to_path_buf(), answers: BTreeMap::new(), stray: None };
    for path in answer_files(folder)? {
        let (file, _) = open_regular(&path, MOST_BYTES)?;
        let at = |number: usize| format!("{}, line {number}", path.display());
        lines::for_each(file, |number, line| recorded.take(line, &asked, || at(number)))
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    }
    Ok((plan, recorded))
}

fn read(path: &Path) -> Result<String, FilesError> {
    Ok(read_regular_text(path, MOST_BYTES)?)
}

fn answer_files(folder: &Path) -> Result<Vec<PathBuf>, FilesError> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder.join("answers")).into_iter().flatten().flatten().map(|f| f.path()).collect();
    files.sort();
    let single = folder.join("answers.jsonl");
    if files.is_empty() || single.is_file() {
        files.insert(0, single);
    }
    Ok(files)
}

impl Recorded {
    /// The first line that answers no problem of the folder, and where, if there is one.
    pub fn stray(&self) -> Option<&str> {
        self.stray.as_deref()
    }

    /// Files a line under the problem that it answers.
    fn take(&mut self, line: Line<'_>, asked: &BTreeSet<String>, place: impl Fn() -> String) {
        let (line, answer) = match line {
            Line::Whole(line) => (line, read_line(line)),
            Line::TooLong(beginning) => (beginning, Err(Breakage::TooLong { limit: MOST_LINE_BYTES })),
        };
        if let Some((id, breakage)) = recorder::broken(line) {
            self.answers.insert(id, Err(breakage));
            return;
        }
        // What a program writes before its first answer is no stray.
        if matches!(Greeting::read(line), Ok(Some(_))) {
            return;
        }
        let id = answer.as_ref().map_or_else(|_| id_in(line).map(str::to_string), |a| Some(a.id.clone()));
        match (id, answer) {
            (Some(id), _) if !asked.contains(&id) => {
                self.stray
                    .get_or_insert_with(|| format!("{}: no problem here is called {}", place(), quoted(&id)));
            }
            (Some(id), answer) => {
                let filed = if self.answers.contains_key(&id) { Err(Breakage::Twice) } else { answer };
                self.answers.insert(id, filed);
            }
            (None, Err(why)) => _ = self.stray.get_or_insert_with(|| format!("{}: {why}", place())),
            (None, Ok(_)) => {}
        }
    }
}

impl Solver for Recorded {
    fn name(&self) -> String {
        format!("answers in {}", self.folder.display())
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        let stray = self.stray.as_ref().map_or(String::new(), |stray| format!(" ({stray})"));
        let missing = || Err(Breakage::Missing { what: format!("the answer to {}{stray}", problem.id) });
        self.answers.get(&problem.id).cloned().unwrap_or_else(missing)
    }

    /// How long an answer took is not in the file: its time is no number.
    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        problems.iter().map(|problem| Given { answer: self.ask(problem), seconds: f64::NAN }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Status;

    /// Refuses all but the problem of this id, to which it has no answer.
    struct Refusing(String);

    impl Solver for Refusing {
        fn name(&self) -> String {
            "refusing".into()
        }

        fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
            match problem.id == self.0 {
                true => Err(Breakage::Timeout { seconds: 2.0 }),
                false => Ok(Answer::without_estimate(&problem.id, Status::Refused, "no")),
            }
        }
    }

    #[test]
    fn answers_that_are_filed_beside_their_problems_are_read_as_they_were_given() {
        let folder = std::env::temp_dir().join(format!("calibench-gate-files-{}", std::process::id()));
        let scenes = ["same-tilt", "three-points"].map(String::from).to_vec();
        let plan = Plan::of(7, 1, Asked { scenes, ..Asked::default() }).unwrap();
        export(&plan, &folder).unwrap();
        let problems: Vec<Problem> = plan.cases.iter().map(|case| plan.problem(case)).collect();
        let lines = std::fs::read_to_string(folder.join("problems.jsonl")).unwrap();
        let written = lines.lines().map(|line| serde_json::from_str(line).unwrap());
        assert_eq!(written.collect::<Vec<Problem>>(), problems);

        let solver = Refusing(problems[1].id.clone());
        let recorder = Recorder::new(&solver);
        recorder.give_all(&problems);
        file_answers(&plan, &folder, &recorder).unwrap();
        let (again, read) = recorded(&folder).unwrap();
        assert_eq!((again.cases, read.stray()), (plan.cases.clone(), None));
        let given = read.give_all(&problems);
        assert_eq!((given.len(), &given[0].answer), (2, &solver.ask(&problems[0])));
        assert!(matches!(&given[1].answer, Err(Breakage::Recorded(why)) if why.contains("within 2 s")));
        assert!(given.iter().all(|given| given.seconds.is_nan()));

        // What took somebody's time is not overwritten, and not joined with other problems.
        assert!(matches!(export(&plan, &folder), Err(FilesError::Answered { .. })));
        let manifest = folder.join("manifest.json");
        let of_others =
            std::fs::read_to_string(&manifest).unwrap().replace(&sha256_hex(lines.as_bytes()), "0");
        std::fs::write(&manifest, of_others).unwrap();
        assert!(matches!(recorded(&folder), Err(FilesError::OtherVersion { .. })));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn files_of_answers_are_read_in_the_order_of_their_names_after_the_single_one() {
        let folder = std::env::temp_dir().join(format!("calibench-gate-answers-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("answers")).unwrap();
        let names = |folder: &Path| -> Vec<String> {
            let name = |file: &PathBuf| file.file_name().unwrap().to_string_lossy().into_owned();
            answer_files(folder).unwrap().iter().map(name).collect()
        };
        assert_eq!(names(&folder), ["answers.jsonl"]);
        for name in ["answers/b", "answers/a"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        assert_eq!(names(&folder), ["a", "b"]);
        std::fs::write(folder.join("answers.jsonl"), "").unwrap();
        assert_eq!(names(&folder), ["answers.jsonl", "a", "b"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_line_is_filed_under_its_problem_once_and_the_first_that_has_none_is_told() {
        let asked = ["a", "b"].map(String::from).into();
        let mut read = Recorded { folder: PathBuf::new(), answers: BTreeMap::new(), stray: None };
        for (number, id) in ["a", "c", "b", "d", "b"].into_iter().enumerate() {
            let line = format!(r#"{{"id":"{id}","status":"refused"}}"#);
            read.take(Line::Whole(&line), &asked, || format!("line {}", number + 1));
        }
        assert!(read.answers["a"].as_ref().is_ok_and(|answer| answer.id == "a"));
        assert_eq!(read.answers["b"], Err(Breakage::Twice));
        assert_eq!(read.answers.len(), 2);
        let stray = read.stray().unwrap();
        assert!(stray.starts_with("line 2: ") && stray.ends_with(" c"), "{stray}");
    }
}
