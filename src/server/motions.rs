//! `POST /v1/motions`: one relative registration.

use super::error::ServerError;
use super::fix_parameters::stated_view;
use super::form::Form;
use super::problem::Problem;
use super::query::NoQuery;
use super::state::ServiceState;
use super::work::Load;
use axum::Json;
use axum::extract::multipart::MultipartRejection;
use axum::extract::{Multipart, State};
use axum::http::HeaderMap;
use overfly_core::camera::{Camera, Intrinsics};
use overfly_core::geodesy::BodyOffset;
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::locate::LocateError;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use utoipa::ToSchema;

/// What is known of two frames besides their pixels. Unknown keys are refused; none is required.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotionParameters {
    /// Ground metres per pixel of image a: then the answer is also in metres. Or `height_m` and `camera`.
    #[schema(exclusive_minimum = 0.0)]
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground of image a, metres; needs `camera`.
    pub height_m: Option<f64>,
    /// The camera of both.
    pub camera: Option<Intrinsics>,
}

/// How image b lies on image a, or why that cannot be said.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MotionReply {
    /// The registration.
    #[serde(flatten)]
    pub answer: MotionAnswer,
    /// The same on the ground, where a scale was stated.
    #[serde(flatten)]
    #[schema(value_type = GroundMotion)]
    pub ground: Option<GroundMotion>,
    /// From the decoded frames to this answer, milliseconds.
    pub elapsed_ms: f64,
}

/// Where image b's centre lies seen from image a's, in image a's own axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct GroundMotion {
    /// Ground sample distance of image a.
    #[schema(required = false)]
    pub gsd_m_per_px: f64,
    /// Towards image a's right edge.
    #[schema(required = false)]
    pub right_m: f64,
    /// Towards image a's upper edge.
    #[schema(required = false)]
    pub ahead_m: f64,
    /// Between both centres.
    #[schema(required = false)]
    pub distance_m: f64,
}

/// The form of a motion.
#[derive(utoipa::ToSchema)]
#[allow(dead_code)]
pub(super) struct MotionForm {
    /// The first frame: PNG, JPEG or WebP.
    #[schema(value_type = String, format = Binary)]
    image_a: Vec<u8>,
    /// The second.
    #[schema(value_type = String, format = Binary)]
    image_b: Vec<u8>,
    /// What is known of them, as JSON; may be left out.
    request: Option<MotionParameters>,
}

impl MotionParameters {
    /// Ground sample distance of image a, where its scale is stated.
    fn gsd_m_per_px(&self, a: &Gray) -> Result<Option<f64>, ServerError> {
        let Some(view) = stated_view(self.gsd_m_per_px, self.height_m, self.camera.as_ref())? else { return Ok(None) };
        let size = |n: usize| u32::try_from(n).expect("frames are bounded");
        let camera = Camera::new(&view, size(a.width_px()), size(a.height_px())).map_err(LocateError::from)?;
        Ok(Some(camera.gsd_m_per_px()))
    }
}

fn on_the_ground(answer: &MotionAnswer, gsd_m_per_px: Option<f64>) -> Option<GroundMotion> {
    let (MotionAnswer::Motion(motion), Some(gsd_m_per_px)) = (answer, gsd_m_per_px) else { return None };
    let moved = BodyOffset::from_image_px(motion.displacement_px, gsd_m_per_px);
    let BodyOffset { right_m, ahead_m } = moved;
    Some(GroundMotion { gsd_m_per_px, right_m, ahead_m, distance_m: moved.length_m() })
}

/// Registers image b against image a.
#[utoipa::path(
    post, path = "/v1/motions", operation_id = "motion", tag = "registration",
    request_body(content = MotionForm, content_type = "multipart/form-data"),
    responses(
        (status = 200, description = "A motion, or none and why", body = MotionReply),
        (status = "4XX", description = "The request is at fault", body = Problem, content_type = "application/problem+json"),
        (status = "5XX", description = "The service is at fault or busy", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(
    State(state): State<ServiceState>,
    _: NoQuery,
    headers: HeaderMap,
    multipart: Result<Multipart, MultipartRejection>,
) -> Result<Json<MotionReply>, ServerError> {
    let mut form = Form::read(&state, &headers, multipart, &["image_a", "image_b", "request"]).await?;
    let parameters: MotionParameters = form.json("request")?;
    stated_view(parameters.gsd_m_per_px, parameters.height_m, parameters.camera.as_ref())?;
    let (bytes_a, bytes_b) = (form.take("image_a")?, form.take("image_b")?);
    let limits = state.limits;
    let reply = state
        .work
        .run(Load::Registration, move || -> Result<MotionReply, ServerError> {
            let a = limits.frame("image_a", &bytes_a)?;
            let b = limits.frame("image_b", &bytes_b)?;
            let gsd_m_per_px = parameters.gsd_m_per_px(&a)?;
            let start = Instant::now();
            let answer = register(&a, &b, &MotionPrior::default());
            let elapsed_ms = start.elapsed().as_micros() as f64 / 1e3;
            Ok(MotionReply { ground: on_the_ground(&answer, gsd_m_per_px), answer, elapsed_ms })
        })
        .await??;
    Ok(Json(reply))
}
