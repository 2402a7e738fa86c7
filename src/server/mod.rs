//! The HTTP service: preflight and onboard routers.
