//! Several searches on one evaluator: candidates that are asked for at the same time go into one call. Small swarms thus fill a
//! device.

use super::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::error::{Error, Result};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// A search that asks for nothing this long is not waited for: it may be busy with something else.
const PATIENCE: Duration = Duration::from_millis(20);

enum Message {
    Asks { client: usize, population: Vec<f64> },
    Leaves,
}

/// What a search is answered.
struct Answer {
    evaluation: Result<Evaluation>,
    /// What gave it.
    backend: BackendInfo,
    /// What has gone wrong with devices since the search was answered before.
    device_faults: Vec<String>,
}

/// The evaluator as one of the searches sees it.
pub struct PackedClient {
    client: usize,
    problem: Problem,
    backend: BackendInfo,
    device_faults: Vec<String>,
    ask: Sender<Message>,
    answer: Receiver<Answer>,
}

impl Evaluator for PackedClient {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn backend(&self) -> BackendInfo {
        self.backend.clone()
    }

    fn device_faults(&self) -> &[String] {
        &self.device_faults
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let gone = || Error::Device("the evaluator that several searches share is gone".to_owned());
        let message = Message::Asks {
            client: self.client,
            population: population.to_vec(),
        };
        self.ask.send(message).map_err(|_| gone())?;
        let answer = self.answer.recv().map_err(|_| gone())?;
        self.backend = answer.backend;
        self.device_faults.extend(answer.device_faults);
        answer.evaluation
    }
}

impl Drop for PackedClient {
    fn drop(&mut self) {
        // A search that ends, however it does, is not waited for.
        let _ = self.ask.send(Message::Leaves);
    }
}

/// Runs `searches` at the same time, each in a thread of its own and with an evaluator that goes through `evaluator`; what they
/// come to, in their order. `pause` is called now and then in this thread, before every call of `evaluator` at least.
///
/// Each candidate is scored by itself, so other searches do not change its result.
///
/// # Errors
/// Every search whose candidates were in a failed call gets the error of `evaluator`, and may pass it on in its result.
pub fn run_packed<T: Send>(
    evaluator: &mut dyn Evaluator,
    searches: Vec<impl FnOnce(PackedClient) -> T + Send>,
    mut pause: impl FnMut(),
) -> Vec<T> {
    let (ask, asked) = channel();
    let (problem, backend) = (evaluator.problem().clone(), evaluator.backend());
    let device_faults = evaluator.device_faults().to_vec();
    let mut answers = Vec::new();
    let clients: Vec<PackedClient> = (0..searches.len())
        .map(|client| {
            let (answer, answered) = channel();
            answers.push(Answers {
                to: answer,
                faults_told: device_faults.len(),
            });
            PackedClient {
                client,
                problem: problem.clone(),
                backend: backend.clone(),
                device_faults: device_faults.clone(),
                ask: ask.clone(),
                answer: answered,
            }
        })
        .collect();
    thread::scope(move |scope| {
        // Gone with this thread, should it panic: searches that wait for an answer see it.
        let (mut answers, asked) = (answers, asked);
        let threads: Vec<_> = searches
            .into_iter()
            .zip(clients)
            .map(|(search, client)| scope.spawn(move || search(client)))
            .collect();
        let mut working = threads.len();
        let mut waiting: Vec<(usize, Vec<f64>)> = Vec::new();
        while working > 0 {
            match asked.recv_timeout(PATIENCE) {
                Ok(Message::Asks { client, population }) => waiting.push((client, population)),
                Ok(Message::Leaves) => working -= 1,
                Err(RecvTimeoutError::Timeout) => {
                    pause();
                    answer(evaluator, &mut waiting, &mut answers);
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if !waiting.is_empty() && waiting.len() == working {
                pause();
                answer(evaluator, &mut waiting, &mut answers);
            }
        }
        threads
            .into_iter()
            .map(|thread| match thread.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
            .collect()
    })
}

/// Where a search is answered, and how many of the evaluator's faults it knows.
struct Answers {
    to: Sender<Answer>,
    faults_told: usize,
}

/// Scores all that wait in one call.
fn answer(evaluator: &mut dyn Evaluator, waiting: &mut Vec<(usize, Vec<f64>)>, answers: &mut [Answers]) {
    if waiting.is_empty() {
        return;
    }
    // The order of arrival depends on threads; that of the call does not where all have asked.
    waiting.sort_by_key(|(client, _)| *client);
    let width = evaluator.problem().objectives.len();
    let dimensions = evaluator.problem().variables.len().max(1);
    let population: Vec<f64> = waiting.iter().flat_map(|(_, p)| p.iter().copied()).collect();
    let whole = evaluator.evaluate(&population);
    let mut first = 0;
    for (client, population) in waiting.drain(..) {
        let count = population.len() / dimensions;
        let part = match &whole {
            Ok(evaluation) => Ok(evaluation.part(first..first + count, width)),
            Err(e) => Err(Error::Device(e.to_string())),
        };
        first += count;
        let answers = &mut answers[client];
        let met = evaluator.device_faults();
        let answer = Answer {
            evaluation: part,
            backend: evaluator.backend(),
            device_faults: met[answers.faults_told..].to_vec(),
        };
        answers.faults_told = met.len();
        // A search that has gone meanwhile needs no answer.
        let _ = answers.to.send(answer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};

    /// The sum of squares; fails on a zero, and meets a fault of the device on each seven.
    struct Squares {
        problem: Problem,
        calls: Vec<usize>,
        faults: Vec<String>,
    }

    impl Evaluator for Squares {
        fn problem(&self) -> &Problem {
            &self.problem
        }
        fn backend(&self) -> BackendInfo {
            BackendInfo {
                backend: if self.faults.len() > 1 { "simd" } else { "cpu" },
                device: String::new(),
                driver: String::new(),
            }
        }
        fn device_faults(&self) -> &[String] {
            &self.faults
        }
        fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
            if population.contains(&0.0) {
                return Err(Error::Device("a zero".to_owned()));
            }
            if population.contains(&7.0) {
                self.faults.push("lost".to_owned());
            }
            self.calls.push(population.len() / 2);
            let rows = population
                .chunks_exact(2)
                .map(|x| (vec![x[0] * x[0] + x[1] * x[1]], None));
            Ok(Evaluation::of_rows(rows.collect()))
        }
    }

    fn squares() -> Squares {
        let variables = ["x", "y"]
            .map(|name| Variable::new(name, "-", -9.0, 9.0))
            .to_vec();
        Squares {
            problem: Problem {
                variables,
                objectives: vec![Objective::new("sum", "-")],
            },
            calls: Vec::new(),
            faults: vec!["opened late".to_owned()],
        }
    }

    #[test]
    fn every_search_hears_of_faults_and_of_what_gave_its_answer() {
        let mut evaluator = squares();
        let searches: Vec<_> = [7.0, 2.0]
            .into_iter()
            .map(|x| {
                move |mut client: PackedClient| {
                    assert_eq!(client.device_faults(), ["opened late"]);
                    client.evaluate(&[x, 1.0]).unwrap();
                    // By now one has met the fault, alone or together with the other.
                    client.evaluate(&[1.0, 1.0]).unwrap();
                    (client.device_faults().to_vec(), client.backend().backend)
                }
            })
            .collect();
        let results = run_packed(&mut evaluator, searches, || {});
        assert_eq!(
            results[0],
            (vec!["opened late".to_owned(), "lost".to_owned()], "simd")
        );
        // The other may have been done before, if its thread was much faster; it hears of it otherwise.
        if evaluator.calls.len() == 2 {
            assert_eq!(results[1], results[0]);
        }
    }

    #[test]
    fn each_gets_its_own_answers_and_small_swarms_share_calls() {
        let mut evaluator = squares();
        let searches: Vec<_> = (1..=4usize)
            .map(|k| {
                move |mut client: PackedClient| -> Result<Vec<f64>> {
                    let mut sums = Vec::new();
                    // Of different sizes and for a different number of times.
                    for round in 1..=3 * k {
                        let population: Vec<f64> = vec![(k * round) as f64; 2 * k];
                        sums.extend(client.evaluate(&population)?.objectives);
                    }
                    Ok(sums)
                }
            })
            .collect();
        let results = run_packed(&mut evaluator, searches, || {});
        for (k, result) in (1..=4usize).zip(results) {
            let expected: Vec<f64> = (1..=3 * k)
                .flat_map(|round| vec![2.0 * ((k * round) as f64).powi(2); k])
                .collect();
            assert_eq!(result.unwrap(), expected);
        }
        // 30 askings; those of one round that nothing holds up go together.
        assert!(evaluator.calls.len() < 30, "{:?}", evaluator.calls);
        assert_eq!(evaluator.calls.iter().sum::<usize>(), 3 * (1 + 4 + 9 + 16));
    }

    #[test]
    fn a_failure_reaches_those_that_asked_and_the_rest_go_on() {
        let mut evaluator = squares();
        let searches: Vec<_> = [0.0, 2.0]
            .into_iter()
            .map(|x| {
                move |mut client: PackedClient| {
                    let first = client.evaluate(&[x, x]);
                    let again = client.evaluate(&[1.0, x + 1.0]);
                    (first.is_err(), again.is_ok())
                }
            })
            .collect();
        let results = run_packed(&mut evaluator, searches, || {});
        assert!(results[0].0 && results.iter().all(|r| r.1), "{results:?}");
    }
}
