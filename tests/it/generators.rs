//! Clients are generated from /openapi.json without a warning, and one of them locates a frame.

use super::overload::served;
use overfly_core::geodesy::{Geodetic, LocalFrame};
use overfly_testkit::drawn::project;
use overfly_testkit::soak::client::ServedStore;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Writes the document of a service into a folder.
fn document(service: &ServedStore, folder: &Path) -> PathBuf {
    let path = folder.join("openapi.json");
    std::fs::write(&path, service.client().get("/openapi.json").unwrap().body).unwrap();
    path
}

/// Runs a tool; returns what it printed.
fn printed(command: &mut Command) -> String {
    let done = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let text = [done.stdout, done.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(done.status.success(), "{command:?}: {text}");
    text
}

#[test]
#[ignore = "needs openapi_python_client"]
fn needs_openapi_python_client_its_client_locates_a_frame_of_the_demo() {
    for is_onboard in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let service = served(folder.path(), is_onboard);
        let client = folder.path().join("client");
        let said = printed(
            Command::new("openapi-python-client")
                .args(["generate", "--meta", "none", "--fail-on-warning", "--path"])
                .arg(document(&service, folder.path()))
                .arg("--output-path")
                .arg(client.join("overfly_client")),
        );
        assert!(!said.to_lowercase().contains("warning") && !said.contains("Unable"), "{said}");
        let request = serde_json::json!({
            "latitude_deg": 48.4915, "longitude_deg": 15.616, "sigma_m": 200, "heading_deg": 271.58, "height_m": 500.41,
            "camera": {
                "width_px": 320, "height_px": 240, "focal_length_px": 400.0, "principal_point_px": [161.3, 118.9],
                "distortion": [-0.06, 0.015, 0.0004, -0.0003, 0.0],
            },
            "pitch_deg": 1.167, "roll_deg": -0.003,
        });
        let found = printed(
            Command::new("python3")
                .arg(project("tests/fixtures/generated_client.py"))
                .args([&client, Path::new(&format!("http://{}", service.address))])
                .arg(project("tiles/flight/frames/019.jpg"))
                .arg(request.to_string()),
        );
        let found: serde_json::Value = serde_json::from_str(&found).unwrap();
        let degrees = |name: &str| found[name].as_f64().unwrap();
        let fix = Geodetic::from_degrees(degrees("latitude_deg"), degrees("longitude_deg")).unwrap();
        let truth = Geodetic::from_degrees(48.490257760, 15.613972227).unwrap();
        let off_m = LocalFrame::at(truth).enu_from_geodetic(fix).length_m();
        assert!(off_m < 5.0, "{off_m} m off");
    }
}

/// What OpenAPI Generator says of any document of version 3.1, and of any schema with `additionalProperties: false` in one.
const HARMLESS: [&str; 2] = ["OpenAPI 3.1 support is still in beta", "Failed to get the schema name: null"];

fn operation_ids(document: &Path) -> Vec<String> {
    let document: serde_json::Value = serde_json::from_slice(&std::fs::read(document).unwrap()).unwrap();
    let items = document["paths"].as_object().unwrap().values();
    let operations = items.flat_map(|item| item.as_object().unwrap().values());
    operations.map(|operation| operation["operationId"].as_str().unwrap().to_owned()).collect()
}

fn python_sources(folder: &Path) -> String {
    std::fs::read_dir(folder).unwrap().map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap()).collect()
}

#[test]
#[ignore = "needs openapi_generator"]
fn needs_openapi_generator_clients_have_every_operation() {
    for is_onboard in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let document = document(&served(folder.path(), is_onboard), folder.path());
        for language in ["python", "java", "typescript-fetch"] {
            let out = folder.path().join(language);
            let mut command = Command::new("openapi-generator-cli");
            command.args(["generate", "-g", language, "-i"]).arg(&document).arg("-o").arg(&out);
            let said = printed(&mut command);
            let warnings: Vec<&str> = said
                .lines()
                .filter(|line| line.contains("WARN") || line.contains("ERROR"))
                .filter(|line| !HARMLESS.iter().any(|harmless| line.contains(harmless)))
                .collect();
            assert!(warnings.is_empty(), "{language}: {warnings:#?}");
            if language == "python" {
                let sources = python_sources(&out.join("openapi_client/api"));
                for id in operation_ids(&document) {
                    assert!(sources.contains(&format!("def {id}(")), "{id} was dropped: {said}");
                }
            }
        }
    }
}
