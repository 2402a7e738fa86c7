//! Many mixed requests on several connections, some abandoned half-way; every answer is checked.

use super::client::{HttpClient, ServedStore, read};
use super::question::{AnswerVerdict, QuestionKind, Questions, SoakQuestion, judge_answer};
use overfly_core::tile::TileId;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufReader, Write};
use std::ops::Range;
use std::time::Duration;

/// The mix of requests, in parts of 10,000.
pub const MIX: &[(ClientBehaviour, u32)] = &[
    (ClientBehaviour::Whole(QuestionKind::Tile), 5_300),
    (ClientBehaviour::Whole(QuestionKind::Candidates), 2_600),
    (ClientBehaviour::Whole(QuestionKind::Descriptors), 500),
    (ClientBehaviour::Whole(QuestionKind::Catalogue), 500),
    (ClientBehaviour::Whole(QuestionKind::Malformed), 400),
    (ClientBehaviour::Dropped, 400),
    (ClientBehaviour::Whole(QuestionKind::Fix), 90),
    (ClientBehaviour::Whole(QuestionKind::FixElsewhere), 40),
    (ClientBehaviour::Whole(QuestionKind::FixWide), 3),
    (ClientBehaviour::Whole(QuestionKind::Motion), 120),
    (ClientBehaviour::Vanished, 30),
    (ClientBehaviour::Slow, 17),
];

/// The behaviour of a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ClientBehaviour {
    /// Sends the whole request and waits for the answer.
    Whole(QuestionKind),
    /// Breaks off in the middle of a request.
    Dropped,
    /// Sends the frame of a fix and goes away during the search.
    Vanished,
    /// Sends a head in two pieces, with a pause.
    Slow,
}

/// The results of one kind of request.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RequestCounts {
    pub asked: u64,
    pub right: u64,
    /// Right answers with a fix or a motion.
    pub found: u64,
    /// 503 with Retry-After.
    pub busy: u64,
    /// Refused because the request needs too much memory.
    pub too_much: u64,
    /// 500 for a tile that was damaged on purpose.
    pub damaged: u64,
}

/// The results of many requests.
#[derive(Debug, Clone, Default)]
pub struct SoakTally {
    pub counts: BTreeMap<String, RequestCounts>,
    /// Wrong answers and failed connections. There must be none.
    pub wrong: Vec<String>,
}

impl SoakTally {
    pub fn asked(&self) -> u64 {
        self.counts.values().map(|c| c.asked).sum()
    }

    pub fn with(mut self, other: Self) -> Self {
        for (kind, more) in other.counts {
            let count = self.counts.entry(kind).or_default();
            count.asked += more.asked;
            count.right += more.right;
            count.found += more.found;
            count.busy += more.busy;
            count.too_much += more.too_much;
            count.damaged += more.damaged;
        }
        self.wrong.extend(other.wrong);
        self
    }

    fn take(&mut self, asked: ClientBehaviour, outcome: RequestOutcome) {
        let name = match asked {
            ClientBehaviour::Whole(kind) => format!("{kind:?}"),
            other => format!("{other:?}"),
        };
        let count = self.counts.entry(name).or_default();
        count.asked += 1;
        match outcome {
            RequestOutcome::Weighed(AnswerVerdict::Right) | RequestOutcome::Unanswered => count.right += 1,
            RequestOutcome::Weighed(AnswerVerdict::Found) => {
                count.right += 1;
                count.found += 1;
            }
            RequestOutcome::Weighed(AnswerVerdict::Busy) => count.busy += 1,
            RequestOutcome::Weighed(AnswerVerdict::TooMuch) => count.too_much += 1,
            RequestOutcome::Weighed(AnswerVerdict::Wrong(why)) => self.wrong.push(why),
            RequestOutcome::Damaged => count.damaged += 1,
            RequestOutcome::Failed(why) => self.wrong.push(format!("{asked:?}: {why}")),
        }
    }
}

enum RequestOutcome {
    Weighed(AnswerVerdict),
    /// The client did not wait for an answer.
    Unanswered,
    /// The service rightly reported a damaged tile.
    Damaged,
    Failed(String),
}

/// Sends the requests `numbers` of the stream of `seed`, on `connections` connections at once. Tiles in `damaged`
/// must not be served.
pub fn ask(
    serving: &ServedStore,
    questions: &Questions,
    damaged: &BTreeSet<TileId>,
    numbers: Range<u64>,
    connections: u64,
    seed: u64,
) -> SoakTally {
    std::thread::scope(|scope| {
        let handles: Vec<_> = (0..connections)
            .map(|worker| {
                let numbers = numbers.clone().filter(move |n| n % connections == worker);
                let mut client = serving.client();
                scope.spawn(move || {
                    let mut tally = SoakTally::default();
                    for number in numbers {
                        let mut dice = StdRng::seed_from_u64(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
                        let asked = drawn(&mut dice);
                        let outcome = ask_one(&mut client, questions, damaged, asked, &mut dice);
                        tally.take(asked, outcome);
                    }
                    tally
                })
            })
            .collect();
        handles
            .into_iter()
            .map(|h| h.join().expect("the thread does not panic"))
            .fold(SoakTally::default(), SoakTally::with)
    })
}

fn drawn(dice: &mut StdRng) -> ClientBehaviour {
    let mut at = dice.random_range(0..MIX.iter().map(|(_, parts)| parts).sum());
    for (asked, parts) in MIX {
        match at < *parts {
            true => return *asked,
            false => at -= parts,
        }
    }
    unreachable!("the parts sum up")
}

fn ask_one(
    client: &mut HttpClient,
    questions: &Questions,
    damaged: &BTreeSet<TileId>,
    asked: ClientBehaviour,
    dice: &mut StdRng,
) -> RequestOutcome {
    let kind = match asked {
        ClientBehaviour::Whole(kind) => kind,
        ClientBehaviour::Dropped | ClientBehaviour::Vanished => QuestionKind::Fix,
        ClientBehaviour::Slow => QuestionKind::Tile,
    };
    let question = questions.get(kind, dice.random_range(0..usize::MAX));
    let reply = match asked {
        ClientBehaviour::Whole(_) => client.send(&question.request),
        ClientBehaviour::Slow => slowly(client, &question.request),
        ClientBehaviour::Dropped => {
            let length = dice.random_range(1..question.request.len());
            return abandon(client, &question.request[..length], Duration::ZERO);
        }
        ClientBehaviour::Vanished => {
            let wait = Duration::from_millis(dice.random_range(0..60));
            return abandon(client, &question.request, wait);
        }
    };
    match reply {
        Err(error) => RequestOutcome::Failed(error.to_string()),
        Ok(reply) => {
            let is_damaged = question.tile.is_some_and(|tile| damaged.contains(&tile));
            if is_damaged && reply.status == 500 && reply.code() == "damaged_store" {
                return RequestOutcome::Damaged;
            }
            weighed(question, &reply, is_damaged)
        }
    }
}

fn weighed(question: &SoakQuestion, reply: &super::client::HttpReply, is_damaged: bool) -> RequestOutcome {
    match judge_answer(question, reply) {
        AnswerVerdict::Right | AnswerVerdict::Found if is_damaged => {
            RequestOutcome::Failed("a damaged tile was given".into())
        }
        verdict => RequestOutcome::Weighed(verdict),
    }
}

fn abandon(client: &HttpClient, bytes: &[u8], wait: Duration) -> RequestOutcome {
    let sent = client.connect().and_then(|mut stream| stream.write_all(bytes));
    std::thread::sleep(wait);
    sent.map_or_else(|e| RequestOutcome::Failed(e.to_string()), |()| RequestOutcome::Unanswered)
}

fn slowly(client: &HttpClient, request: &[u8]) -> std::io::Result<super::client::HttpReply> {
    let mut stream = client.connect()?;
    let (first, rest) = request.split_at(request.len() / 2);
    stream.write_all(first)?;
    std::thread::sleep(Duration::from_millis(150));
    stream.write_all(rest)?;
    Ok(read(&mut BufReader::new(stream))?.0)
}
