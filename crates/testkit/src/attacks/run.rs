//! Runs one attack on one service, while two probers ask for the health of that service and of one that nobody attacks: what the
//! second one measures is the noise of the machine.

use super::attack::Attack;
use super::material::AttackMaterial;
use super::prober::ProbeTimes;
use crate::soak::client::ServedStore;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// What an attack did.
#[derive(Debug)]
pub struct AttackResult {
    /// The health of the service that was attacked.
    pub health: ProbeTimes,
    /// The health of the other one.
    pub noise: ProbeTimes,
    /// The most memory that the service held during the attack, kB.
    pub resident_kb: u64,
    /// Answers to the attackers by status; 0 counts connections without one.
    pub answers: BTreeMap<u16, usize>,
    /// Whether the service still runs.
    pub lives: bool,
}

/// Attacks with so many clients for so long.
pub fn run(
    attack: Attack,
    material: &AttackMaterial,
    attacked: &mut ServedStore,
    idle: &ServedStore,
    clients: usize,
    time: Duration,
) -> AttackResult {
    // Resets `VmHWM`; where that is refused, it stays the most since the start.
    let _ = std::fs::write(format!("/proc/{}/clear_refs", attacked.pid()), "5");
    let end = Instant::now() + time;
    let address = &attacked.address;
    let (health, noise, answers) = std::thread::scope(|scope| {
        let health = scope.spawn(move || ProbeTimes::measure(address, end));
        let noise = scope.spawn(move || ProbeTimes::measure(&idle.address, end));
        let all: Vec<_> = (0..clients)
            .map(|client| scope.spawn(move || attack.run(address, material, (client, clients), end)))
            .collect();
        let mut answers = BTreeMap::new();
        for client in all {
            for (status, count) in client.join().expect("a client does not panic") {
                *answers.entry(status).or_default() += count;
            }
        }
        let joined = |prober: std::thread::ScopedJoinHandle<'_, ProbeTimes>| prober.join().expect("no panic");
        (joined(health), joined(noise), answers)
    });
    let resident_kb = attacked.memory_kb("VmHWM");
    AttackResult { health, noise, resident_kb, answers, lives: attacked.lives() }
}
