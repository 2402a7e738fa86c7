//! /openapi.json is one that generators accept, and says what the service does: of both services, on the ground and onboard.

use super::http::Stand;
use super::sources::root;
use overfly::server::{Limits, Service};
use overfly_store::Reader;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Files with code words of problem documents, beside `src/server/`.
const CODES: &[&str] = &[
    "crates/core/src/camera/error.rs",
    "crates/core/src/coupling/error.rs",
    "crates/core/src/region/error.rs",
    "crates/flight/src/frame/error.rs",
    "crates/flight/src/locate/candidates/error.rs",
    "crates/flight/src/locate/error.rs",
    "crates/ingest/src/export/error.rs",
    "crates/ingest/src/plan/error.rs",
    "crates/store/src/error.rs",
    "crates/store/src/package/error.rs",
    "src/server/error.rs",
    "src/server/form_error.rs",
    "src/server/query.rs",
    "src/server/refusal.rs",
];

/// The documents of both services.
fn documents() -> [Value; 2] {
    [Service::Preflight, Service::Onboard]
        .map(|service| Stand::with(service, Limits::default()).get("/openapi.json").json())
}

/// The operations of a document, by method and path.
fn operations(document: &Value) -> BTreeMap<String, &Value> {
    let paths = document["paths"].as_object().unwrap();
    paths
        .iter()
        .flat_map(|(path, item)| {
            item.as_object().unwrap().iter().map(move |(method, operation)| (format!("{method} {path}"), operation))
        })
        .collect()
}

/// Calls `check` with every object in a value, and with where it is.
fn every_object(value: &Value, place: &str, check: &mut impl FnMut(&Value, &str)) {
    match value {
        Value::Object(members) => {
            check(value, place);
            members.iter().for_each(|(key, member)| every_object(member, &format!("{place}/{key}"), check));
        }
        Value::Array(items) => items.iter().for_each(|item| every_object(item, place, check)),
        _ => {}
    }
}

/// The schema that a reference names, or the schema itself.
fn resolved<'a>(document: &'a Value, schema: &'a Value) -> &'a Value {
    match schema["$ref"].as_str() {
        Some(reference) => document.pointer(&reference[1..]).unwrap_or_else(|| panic!("{reference} leads nowhere")),
        None => schema,
    }
}

/// Why an example does not fit its schema, as far as the schemas of this service go.
fn misfit(document: &Value, schema: &Value, example: &Value) -> Option<String> {
    let schema = resolved(document, schema);
    if let Some(choices) = schema["oneOf"].as_array() {
        let fitting = choices.iter().filter(|choice| misfit(document, choice, example).is_none()).count();
        return (fitting != 1).then(|| format!("{example} fits {fitting} of {}", schema["oneOf"]));
    }
    if let Some(words) = schema["enum"].as_array().filter(|words| !words.contains(example)) {
        return Some(format!("{example} is not in {words:?}"));
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        one => one.as_str().into_iter().collect(),
    };
    let kind = match example {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_u64() && types.contains(&"integer") => "integer",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    if !types.is_empty() && !types.contains(&kind) {
        return Some(format!("{example} is no {types:?}"));
    }
    match example {
        Value::Array(items) => {
            let length = items.len() as u64;
            let is_within = schema["minItems"].as_u64().is_none_or(|least| length >= least)
                && schema["maxItems"].as_u64().is_none_or(|most| length <= most);
            if !is_within {
                return Some(format!("{example} has {length} items"));
            }
            items.iter().find_map(|item| misfit(document, &schema["items"], item))
        }
        Value::Object(members) => {
            let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
            let absent = required.filter(|name| !members.contains_key(*name)).map(|name| format!("{name} is absent"));
            let properties = schema["properties"].as_object();
            let wrong = members.iter().filter_map(|(name, member)| match properties {
                None => None,
                Some(properties) => match properties.get(name) {
                    Some(property) => misfit(document, property, member).map(|why| format!("{name}: {why}")),
                    None => Some(format!("{name} is unknown")),
                },
            });
            absent.chain(wrong).next()
        }
        _ => None,
    }
}

#[test]
fn licence_servers_and_operation_ids_are_stated() {
    for document in documents() {
        assert_eq!(document["info"]["license"]["identifier"], "MIT OR Apache-2.0");
        assert!(document["info"]["license"].get("url").is_none(), "identifier and url exclude each other");
        assert_eq!(document["servers"][0]["url"], "/");
        let operations = operations(&document);
        let ids: BTreeSet<&str> = operations.values().filter_map(|o| o["operationId"].as_str()).collect();
        assert_eq!(ids.len(), operations.len(), "{ids:?}");
        assert!(!ids.contains("get") && !ids.contains("post"), "{ids:?}");
    }
}

#[test]
fn every_route_says_how_it_can_fail() {
    for document in documents() {
        for (name, operation) in operations(&document) {
            for status in ["4XX", "500", "503"] {
                let schema = &operation["responses"][status]["content"]["application/problem+json"]["schema"];
                assert_eq!(schema["$ref"], "#/components/schemas/Problem", "{name} {status}");
            }
        }
        assert!(misfit(&document, &document["components"]["schemas"]["Problem"], &serde_json::json!({})).is_some());
    }
}

#[test]
fn every_choice_of_schemas_is_told_by_a_discriminator_and_no_list_is_closed_by_false() {
    for document in documents() {
        let mut choices = 0;
        every_object(&document, "", &mut |object, place| {
            assert_ne!(object.get("items"), Some(&Value::Bool(false)), "{place}");
            assert!(object.get("prefixItems").is_none(), "{place}");
            assert!(object.get("allOf").is_none(), "{place}: generators drop unions with allOf");
            let Some(variants) = object.get("oneOf").and_then(Value::as_array) else { return };
            // An optional object is a choice between null and itself.
            let variants: Vec<&Value> = variants.iter().filter(|v| v["type"] != "null").collect();
            if variants.len() < 2 {
                return;
            }
            choices += 1;
            let name = object["discriminator"]["propertyName"].as_str().unwrap_or_else(|| panic!("{place}"));
            let mapping = object["discriminator"]["mapping"].as_object().unwrap();
            let mapped: BTreeSet<&str> = mapping.values().filter_map(Value::as_str).collect();
            let named: BTreeSet<&str> = variants.iter().filter_map(|v| v["$ref"].as_str()).collect();
            assert_eq!((mapped, variants.len()), (named.clone(), named.len()), "{place}");
            for (word, reference) in mapping {
                let schema = resolved(&document, variants.iter().find(|v| v["$ref"] == *reference).unwrap());
                assert!(schema["required"].as_array().unwrap().contains(&Value::from(name)), "{reference}");
                let words = resolved(&document, &schema["properties"][name]);
                assert!(words["enum"].as_array().unwrap().contains(&Value::from(word.as_str())), "{reference}");
            }
        });
        assert!(choices >= 3, "{choices} choices");
    }
}

#[test]
fn every_request_response_and_parameter_has_an_example_that_fits() {
    for document in documents() {
        let schemas = document["components"]["schemas"].as_object().unwrap();
        let mut examples = 0;
        for (name, schema) in schemas {
            if let Some(example) = schema.get("example") {
                let why = misfit(&document, schema, example);
                assert!(why.is_none(), "{name}: {why:?}");
                examples += 1;
            }
        }
        assert!(examples >= 20, "{examples} examples");
        for (name, operation) in operations(&document) {
            for parameter in operation["parameters"].as_array().into_iter().flatten() {
                let example = parameter.get("example").unwrap_or_else(|| panic!("{name}: {parameter}"));
                let why = misfit(&document, &parameter["schema"], example);
                assert!(why.is_none(), "{name}: {parameter}: {why:?}");
            }
            let responses = operation["responses"].as_object().unwrap().values();
            for body in responses.chain(operation.get("requestBody")) {
                for (media_type, content) in body["content"].as_object().into_iter().flatten() {
                    let schema = resolved(&document, &content["schema"]);
                    let item = resolved(&document, &schema["items"]);
                    let is_json = media_type.ends_with("json");
                    let is_shown = !is_json || schema.get("example").or(item.get("example")).is_some();
                    assert!(is_shown, "{name}: {media_type}: {content} has no example");
                    let is_text = media_type.starts_with("text/");
                    assert!(!is_text || content["example"].is_string(), "{name}: {content} has no example");
                }
            }
        }
    }
}

#[test]
fn the_codes_of_problems_are_those_in_the_sources() {
    let mut codes: BTreeSet<String> = BTreeSet::new();
    for file in CODES {
        let text = std::fs::read_to_string(root().join(file)).unwrap();
        let code = text.split_once("fn code(&self)").unwrap().1.split_once("\n    }").unwrap().0;
        codes.extend(code.split('"').skip(1).step_by(2).map(str::to_owned));
    }
    // Made where the answer is, not from an error type.
    codes.extend(["request_refused", "range_not_satisfiable", "export_too_large"].map(str::to_owned));
    for document in documents() {
        let listed = document["components"]["schemas"]["ProblemCode"]["enum"].as_array().unwrap();
        let listed: BTreeSet<String> = listed.iter().map(|code| code.as_str().unwrap().to_owned()).collect();
        assert_eq!(listed, codes);
    }
}

/// Checks a JSON answer against the schema that the document states for its route and status.
fn check_answer(document: &Value, operation: &str, status: &str, answer: &Value) {
    let (method, path) = operation.split_once(' ').unwrap();
    let content = document["paths"][path][method]["responses"][status]["content"].as_object().unwrap();
    let schema = &content.iter().find(|(media_type, _)| media_type.ends_with("json")).unwrap().1["schema"];
    let why = misfit(document, schema, answer);
    assert!(why.is_none(), "{operation}: {why:?}: {answer}");
}

#[test]
fn answers_have_the_schemas_that_are_stated() {
    let stand = Stand::new();
    let document = stand.get("/openapi.json").json();
    let check = |operation: &str, status: &str, answer: &Value| check_answer(&document, operation, status, answer);
    for path in ["/v1/store", "/v1/layers", "/v1/coverage", "/v1/exports"] {
        check(&format!("get {path}"), "200", &stand.get(path).json());
    }
    check("get /v1/tiles/{layer}/tilejson.json", "200", &stand.get("/v1/tiles/ortho/tilejson.json").json());
    check("get /v1/candidates", "200", &stand.get(&super::http::question(&[])).json());
    check("get /v1/candidates", "4XX", &stand.get("/v1/candidates?mode=x").json());
    let frame = super::http::png(128, 96);
    let taken = |number: u32| {
        let name = format!("tiles/flight/frames/{number:03}.jpg");
        std::fs::read(overfly_testkit::drawn::project(&name)).unwrap()
    };
    let scaled = br#"{"gsd_m_per_px": 1.0}"#;
    for (a, b, request, status) in [
        (taken(19), taken(20), &scaled[..], "motion"),
        (taken(19), taken(20), b"{}", "motion"),
        (taken(19), taken(1), scaled, "no_motion"),
        (frame.clone(), frame.clone(), scaled, "no_motion"),
    ] {
        let answer = stand.post("/v1/motions", &[("image_a", &a), ("image_b", &b), ("request", request)]).json();
        assert_eq!(
            (answer["status"].as_str(), answer["gsd_m_per_px"].is_number()),
            (Some(status), status == "motion" && request == scaled)
        );
        check("post /v1/motions", "200", &answer);
    }
    let no_fix = stand.post("/v1/fixes", &[("image", &frame), ("request", br#"{"gsd_m_per_px": 3.0}"#)]).json();
    check("post /v1/fixes", "200", &no_fix);
    let ground = Stand::over(Reader::open(overfly_testkit::drawn::drawn_store().path()).unwrap());
    let request = br#"{"latitude_deg": 48.4915, "longitude_deg": 15.616, "sigma_m": 200, "heading_deg": 271.6, "gsd_m_per_px": 1.25}"#;
    let fix = ground.post("/v1/fixes", &[("image", &taken(19)), ("request", request)]).json();
    assert_eq!(fix["status"], "fix");
    check("post /v1/fixes", "200", &fix);
    check("get /v1/coverage", "200", &ground.get("/v1/coverage").json());
}
