//! Requests drawn from /openapi.json by Schemathesis: no answer is a 5xx, none has a status, media type, header or body that the
//! document does not state, and what the document forbids is refused.

use super::overload::served;
use std::process::Command;

/// Cases drawn for each operation in one run.
const CASES_PER_OPERATION: &str = "25";

/// Cases over both services; `OVERFLY_CASES` sets another number.
fn cases() -> u64 {
    std::env::var("OVERFLY_CASES").map_or(800, |n| n.parse().expect("OVERFLY_CASES is a number"))
}

/// One export is written at a time: a second one meanwhile is refused with the documented 503. Nothing else may be.
const CONFIGURATION: &str = r#"
[[operations]]
include-name = "POST /v1/exports"
checks.not_a_server_error.expected-statuses = ["2xx", "3xx", "4xx", 503]
"#;

#[test]
#[ignore = "needs schemathesis"]
fn needs_schemathesis_no_answer_is_a_5xx_or_undocumented() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.json");
    let configuration = folder.path().join("schemathesis.toml");
    std::fs::write(&configuration, CONFIGURATION).unwrap();
    let mut drawn = 0;
    for is_onboard in [false, true] {
        let home = tempfile::tempdir().unwrap();
        let mut service = served(home.path(), is_onboard);
        let mut of_service = 0;
        let mut seed = 0;
        while of_service < cases() / 2 {
            seed += 1;
            let done = Command::new("schemathesis")
                .arg("--config-file")
                .arg(&configuration)
                .args(["run", "--no-color", "--continue-on-failure", "--phases", "examples,coverage,fuzzing"])
                // The document states the form of a request, not which parameters go together: a request of the right form may be
                // refused.
                .args(["--checks", "all", "--exclude-checks", "positive_data_acceptance"])
                .args(["--max-examples", CASES_PER_OPERATION, "--generation-database", "none"])
                .args(["--suppress-health-check", "all", "--request-timeout", "70", "--warnings", "off"])
                .args(["--seed", &seed.to_string(), "--report", "json", "--report-json-path"])
                .arg(&report)
                .arg(format!("http://{}/openapi.json", service.address))
                .current_dir(folder.path())
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&done.stdout);
            assert!(done.status.success(), "seed {seed}: {said}\n{}", String::from_utf8_lossy(&done.stderr));
            assert!(service.lives(), "the service ended");
            let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
            of_service += report["test_cases"]["generated"].as_u64().unwrap();
        }
        drawn += of_service;
    }
    println!("{drawn} cases");
}
