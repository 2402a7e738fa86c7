//! The OpenAPI document: what it says of the whole service, and what it says of every route alike.

use super::problem::{PROBLEM_JSON, Problem};
use serde_json::{Map, Value, json};
use utoipa::OpenApi;

/// A document without routes.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "overfly",
        description = "A tile database for flying without GPS: which tiles to search, and where a camera frame was taken. \
            Each name ends in its unit: degrees, metres or seconds. Positions are WGS84.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "The service that answered this document")),
    components(schemas(Problem)),
    tags(
        (name = "search", description = "Tiles to search"),
        (name = "registration", description = "Fixes and motions"),
        (name = "store", description = "Content of the store"),
        (name = "tiles", description = "Imagery and descriptors"),
        (name = "exports", description = "Extracts of the store for one flight; on the ground only"),
        (name = "operations", description = "Health and metrics, for operators")
    )
)]
pub(super) struct Api;

/// An example of each schema, and of each parameter that several routes take.
const EXAMPLES: &str = include_str!("examples.json");

/// Completes the description of the routes: the problem documents that any route may answer, the schema of binary bodies, and
/// examples.
pub(super) fn finished(api: &utoipa::openapi::OpenApi) -> Value {
    let mut document = serde_json::to_value(api).expect("the description serialises");
    let examples: Value = serde_json::from_str(EXAMPLES).expect("the examples are JSON");
    for operation in operations(&mut document) {
        add_problems(object(&mut operation["responses"]));
        for parameter in operation.get_mut("parameters").and_then(Value::as_array_mut).into_iter().flatten() {
            let name = parameter["name"].as_str().unwrap_or_default();
            if let Some(example) = examples["parameters"].get(name) {
                object(parameter).entry("example").or_insert(example.clone());
            }
        }
    }
    for (name, schema) in object(&mut document["components"]["schemas"]) {
        if let Some(example) = examples["schemas"].get(name) {
            object(schema).insert("example".into(), example.clone());
        }
    }
    document
}

fn operations(document: &mut Value) -> impl Iterator<Item = &mut Value> {
    object(&mut document["paths"]).values_mut().flat_map(|path| object(path).values_mut())
}

fn object(value: &mut Value) -> &mut Map<String, Value> {
    value.as_object_mut().expect("the description has an object here")
}

/// Adds the problem documents of an operation, and the schema of its binary answers.
fn add_problems(responses: &mut Map<String, Value>) {
    for response in responses.values_mut() {
        for (media_type, content) in response.get_mut("content").and_then(Value::as_object_mut).into_iter().flatten() {
            if !media_type.starts_with("text/") && !media_type.ends_with("json") {
                content["schema"] = json!({ "type": "string", "format": "binary" });
            }
        }
    }
    let problem = |description: &str| {
        let content = json!({ PROBLEM_JSON: { "schema": { "$ref": "#/components/schemas/Problem" } } });
        json!({ "description": description, "content": content })
    };
    responses.entry("4XX").or_insert_with(|| problem("The request is not valid or not admitted"));
    responses.entry("500").or_insert_with(|| problem("The service failed; its log has the details"));
    let mut busy = problem("The service is busy, or its store was replaced or removed: try again");
    let seconds = json!({ "type": "integer", "minimum": 0 });
    busy["headers"] = json!({ "Retry-After": { "description": "Seconds to wait", "schema": seconds } });
    responses.entry("503").or_insert(busy);
}
