//! Many mixed requests on several connections at once, among them such as break off half-way; every answer weighed.

use super::client::{Client, Serving, read};
use super::question::{Kind, Question, Questions, Verdict, weigh};
use overfly_core::tile::TileId;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufReader, Write};
use std::ops::Range;
use std::time::Duration;

/// In what proportion what is asked: parts of 10,000.
pub const MIX: &[(Asked, u32)] = &[
    (Asked::Whole(Kind::Tile), 5_300),
    (Asked::Whole(Kind::Candidates), 2_600),
    (Asked::Whole(Kind::Descriptors), 500),
    (Asked::Whole(Kind::Catalogue), 500),
    (Asked::Whole(Kind::Malformed), 400),
    (Asked::Dropped, 400),
    (Asked::Whole(Kind::Fix), 90),
    (Asked::Whole(Kind::FixElsewhere), 40),
    (Asked::Whole(Kind::FixWide), 3),
    (Asked::Whole(Kind::Motion), 120),
    (Asked::Vanished, 30),
    (Asked::Slow, 17),
];

/// How a client behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Asked {
    /// Sends all and waits for the answer.
    Whole(Kind),
    /// Breaks off in the middle of a request.
    Dropped,
    /// Sends the frame of a fix and goes away while it is searched for.
    Vanished,
    /// Sends a head in two pieces, with a pause.
    Slow,
}

/// What came of one kind of request.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Count {
    pub asked: u64,
    pub right: u64,
    /// Of these such as found something: a fix, a motion.
    pub found: u64,
    /// 503 with Retry-After.
    pub busy: u64,
    /// Refused because more would be needed than may be held.
    pub too_much: u64,
    /// 500 on a tile that was damaged on purpose.
    pub damaged: u64,
}

/// What came of many requests.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    pub counts: BTreeMap<String, Count>,
    /// Wrong answers and connections that failed; none may be.
    pub wrong: Vec<String>,
}

impl Tally {
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

    fn take(&mut self, asked: Asked, outcome: Outcome) {
        let name = match asked {
            Asked::Whole(kind) => format!("{kind:?}"),
            other => format!("{other:?}"),
        };
        let count = self.counts.entry(name).or_default();
        count.asked += 1;
        match outcome {
            Outcome::Weighed(Verdict::Right) | Outcome::Unanswered => count.right += 1,
            Outcome::Weighed(Verdict::Found) => {
                count.right += 1;
                count.found += 1;
            }
            Outcome::Weighed(Verdict::Busy) => count.busy += 1,
            Outcome::Weighed(Verdict::TooMuch) => count.too_much += 1,
            Outcome::Weighed(Verdict::Wrong(why)) => self.wrong.push(why),
            Outcome::Damaged => count.damaged += 1,
            Outcome::Failed(why) => self.wrong.push(format!("{asked:?}: {why}")),
        }
    }
}

enum Outcome {
    Weighed(Verdict),
    /// Nobody waited for an answer.
    Unanswered,
    /// Refused as damaged, rightly.
    Damaged,
    Failed(String),
}

/// Sends requests number `numbers` of a stream that `seed` tells apart, on `connections` connections at once. Of the tiles
/// `damaged` nothing may be given.
pub fn ask(
    serving: &Serving,
    questions: &Questions,
    damaged: &BTreeSet<TileId>,
    numbers: Range<u64>,
    connections: u64,
    seed: u64,
) -> Tally {
    std::thread::scope(|scope| {
        let handles: Vec<_> = (0..connections)
            .map(|worker| {
                let numbers = numbers.clone().filter(move |n| n % connections == worker);
                let mut client = serving.client();
                scope.spawn(move || {
                    let mut tally = Tally::default();
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
        handles.into_iter().map(|h| h.join().unwrap()).fold(Tally::default(), Tally::with)
    })
}

fn drawn(dice: &mut StdRng) -> Asked {
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
    client: &mut Client,
    questions: &Questions,
    damaged: &BTreeSet<TileId>,
    asked: Asked,
    dice: &mut StdRng,
) -> Outcome {
    let kind = match asked {
        Asked::Whole(kind) => kind,
        Asked::Dropped | Asked::Vanished => Kind::Fix,
        Asked::Slow => Kind::Tile,
    };
    let question = questions.of_kind(kind, dice.random_range(0..usize::MAX));
    let reply = match asked {
        Asked::Whole(_) => client.send(&question.request),
        Asked::Slow => slowly(client, &question.request),
        Asked::Dropped => {
            let length = dice.random_range(1..question.request.len());
            return abandon(client, &question.request[..length], Duration::ZERO);
        }
        Asked::Vanished => {
            let wait = Duration::from_millis(dice.random_range(0..60));
            return abandon(client, &question.request, wait);
        }
    };
    match reply {
        Err(error) => Outcome::Failed(error.to_string()),
        Ok(reply) => {
            let is_damaged = question.tile.is_some_and(|tile| damaged.contains(&tile));
            if is_damaged && reply.status == 500 && reply.code() == "damaged_store" {
                return Outcome::Damaged;
            }
            weighed(question, &reply, is_damaged)
        }
    }
}

fn weighed(question: &Question, reply: &super::client::Reply, is_damaged: bool) -> Outcome {
    match weigh(question, reply) {
        Verdict::Right | Verdict::Found if is_damaged => Outcome::Failed("a damaged tile was given".into()),
        verdict => Outcome::Weighed(verdict),
    }
}

fn abandon(client: &Client, bytes: &[u8], wait: Duration) -> Outcome {
    let sent = client.connect().and_then(|mut stream| stream.write_all(bytes));
    std::thread::sleep(wait);
    sent.map_or_else(|e| Outcome::Failed(e.to_string()), |()| Outcome::Unanswered)
}

fn slowly(client: &Client, request: &[u8]) -> std::io::Result<super::client::Reply> {
    let mut stream = client.connect()?;
    let (first, rest) = request.split_at(request.len() / 2);
    stream.write_all(first)?;
    std::thread::sleep(Duration::from_millis(150));
    stream.write_all(rest)?;
    Ok(read(&mut BufReader::new(stream))?.0)
}
