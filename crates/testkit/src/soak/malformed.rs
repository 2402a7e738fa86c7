//! Malformed requests, which a service must refuse.

use super::client::{get, post};

/// Malformed requests.
pub fn malformed_requests() -> Vec<Vec<u8>> {
    let raw = |text: &str| text.as_bytes().to_vec();
    let mut requests = vec![
        raw("GET /v1/candidates?latitude_deg=NaN HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("GET /v1/candidates HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("GET /v1/tiles/ortho/99/1/1 HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("GET /v1/tiles/none/3/1/1 HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("GET /v1/tiles/%ff/3/1/1 HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("DELETE /v1/store HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("GET /nothing HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        raw("POST /v1/fixes HTTP/1.1\r\nhost: localhost\r\ncontent-type: text/plain\r\ncontent-length: 3\r\n\r\nabc"),
        raw(
            "POST /v1/fixes HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ncontent-length: 9\r\n\r\n--b\r\nxxxx",
        ),
        raw("nonsense\r\n\r\n"),
        raw("GET / HTTP/9.9\r\n\r\n"),
        get(&format!("/v1/candidates?{}=1", "x".repeat(5_000))),
    ];
    let json: &[u8] = br#"{"gsd_m_per_px": 1.0}"#;
    for image in
        [&b""[..], b"no image", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0\0\0\0\0"]
    {
        requests.push(post("/v1/fixes", &[("image", image), ("request", json)]));
        requests.push(post("/v1/motions", &[("image_a", image), ("image_b", image)]));
    }
    let deep = "[".repeat(10_000);
    requests.push(post("/v1/fixes", &[("image", b"x"), ("request", deep.as_bytes())]));
    requests
}
