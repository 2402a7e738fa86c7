//! `ProblemCode`: the code words of problem documents, as /openapi.json lists them.

use std::borrow::Cow;
use utoipa::openapi::schema::{ObjectBuilder, Schema, Type};
use utoipa::{PartialSchema, ToSchema};

/// The schema of `code` in a problem document. `tests/it/openapi.rs` compares it with the code words in the sources.
pub(super) struct ProblemCode;

impl PartialSchema for ProblemCode {
    fn schema() -> utoipa::openapi::RefOr<Schema> {
        ObjectBuilder::new()
            .schema_type(Type::String)
            .description(Some("What happened, as a stable word for programs."))
            .enum_values(Some(CODES))
            .into()
    }
}

impl ToSchema for ProblemCode {
    fn name() -> Cow<'static, str> {
        "ProblemCode".into()
    }
}

/// Every code word, sorted.
const CODES: [&str; 114] = [
    "already_signed",
    "altered_manifest",
    "altered_patch",
    "altered_seal",
    "bad_camera",
    "bad_parameter",
    "below_ground",
    "beyond_quarter_turn",
    "body_broken",
    "body_too_large",
    "body_too_slow",
    "busy",
    "camera_does_not_fit_frame",
    "clock_implausible",
    "corridor_width",
    "cross_origin",
    "cut_off",
    "damaged_store",
    "disk_error",
    "disk_full",
    "empty_store",
    "expired_store",
    "export_too_large",
    "export_under_way",
    "foreign_schema",
    "given_up",
    "host_not_allowed",
    "image_damaged",
    "image_too_large",
    "image_unreadable",
    "in_the_way",
    "internal",
    "io",
    "key_exists",
    "layer_exists",
    "layer_name",
    "layer_not_stated",
    "memory_too_small",
    "method_not_allowed",
    "mode_unknown",
    "newer_store",
    "no_descriptors",
    "no_fixed_point",
    "no_journal",
    "no_serial",
    "no_such_export",
    "no_such_folder",
    "no_such_layer",
    "no_such_route",
    "no_such_tile",
    "no_terrain",
    "no_tile_in_corridor",
    "no_time",
    "not_a_calibration",
    "not_a_key",
    "not_a_patch",
    "not_a_route",
    "not_a_store",
    "not_an_aircraft",
    "not_an_image",
    "not_exported",
    "not_multipart",
    "older_serial",
    "older_store",
    "opened_for_writing",
    "other_contract",
    "other_result",
    "out_of_domain",
    "parameter_conflict",
    "parameter_empty",
    "parameter_missing",
    "parameter_not_a_number",
    "parameter_not_finite",
    "parameter_out_of_range",
    "parameter_repeated",
    "parameter_unknown",
    "part_missing",
    "part_repeated",
    "part_unknown",
    "path",
    "permission_denied",
    "position_out_of_range",
    "randomness",
    "range_not_satisfiable",
    "region_too_large",
    "relative_count_above_max",
    "request_not_valid",
    "request_refused",
    "route_too_long",
    "same_file",
    "sealed_store",
    "search_too_wide",
    "side_file",
    "speed_above_max",
    "sqlite",
    "stale_layer",
    "starts_too_late",
    "store_busy",
    "store_changed",
    "store_not_found",
    "superseded",
    "tile_encoding",
    "tile_name",
    "time_limit",
    "token_required",
    "too_far_off_nadir",
    "too_large",
    "too_many_comparisons",
    "too_many_tiles",
    "unfinished_build",
    "unreadable",
    "unsigned_store",
    "wrong_base",
    "wrong_key",
];
