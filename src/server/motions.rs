//! `POST /v1/motions`: runs one relative registration.

use super::dto::{MotionParameters, MotionReply};
use super::error::ServerError;
use super::form::Form;
use super::no_query::NoQuery;
use super::problem::Problem;
use super::served::Served;
use super::work::WorkClass;
use axum::Json;
use axum::extract::Request;
use overfly_core::camera::{Camera, View};
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{MotionPrior, register};
use overfly_flight::locate::LocateError;
use std::time::Instant;

/// The form of a motion.
#[derive(utoipa::ToSchema)]
#[allow(dead_code)]
pub(super) struct MotionForm {
    /// The first frame: PNG, JPEG or WebP.
    #[schema(value_type = String, format = Binary)]
    image_a: Vec<u8>,
    /// The second frame.
    #[schema(value_type = String, format = Binary)]
    image_b: Vec<u8>,
    /// What is known of the frames, as JSON; optional.
    #[schema(nullable = false)]
    request: Option<MotionParameters>,
}

/// Registers image b against image a.
#[utoipa::path(
    post, path = "/v1/motions", operation_id = "motion", tag = "registration",
    request_body(content = MotionForm, content_type = "multipart/form-data"),
    responses(
        (status = 200, description = "A motion, or no motion with the reason", body = MotionReply),
        (status = "4XX", description = "The request is not valid", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(super) async fn post(
    Served(state): Served,
    _: NoQuery,
    request: Request,
) -> Result<Json<MotionReply>, ServerError> {
    let mut form = Form::read(&state, request, &["image_a", "image_b", "request"]).await?;
    let parameters: MotionParameters = form.json("request")?;
    let view = parameters.view().view()?;
    let (bytes_a, bytes_b) = (form.take("image_a")?, form.take("image_b")?);
    let limits = state.limits;
    let reply = state
        .work
        .run(WorkClass::Registration, move || -> Result<MotionReply, ServerError> {
            let a = limits.frame("image_a", &bytes_a)?;
            let b = limits.frame("image_b", &bytes_b)?;
            let gsd_m_per_px = view.map(|view| gsd_m_per_px(&view, &a)).transpose()?;
            let start = Instant::now();
            let answer = register(&a, &b, &MotionPrior::default());
            let elapsed_ms = start.elapsed().as_micros() as f64 / 1e3;
            Ok(MotionReply::new(answer, gsd_m_per_px, elapsed_ms))
        })
        .await??;
    state.metrics.count_motion(&reply);
    Ok(Json(reply))
}

/// Ground sample distance of image a.
fn gsd_m_per_px(view: &View, a: &Gray) -> Result<f64, LocateError> {
    let size = |n: usize| u32::try_from(n).expect("frames are bounded");
    Ok(Camera::new(view, size(a.width_px()), size(a.height_px()))?.gsd_m_per_px())
}
