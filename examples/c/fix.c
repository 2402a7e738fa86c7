/* Locates a camera frame from C: fix STORE FRAME prints the fix of frame 19 of the flight in tiles/.
 *
 *   cargo build --release -p overfly-capi
 *   cc -I crates/capi/include examples/c/fix.c -L target/release -loverfly_capi -Wl,-rpath,target/release -o fix
 *   ./fix walk.gpkg tiles/flight/frames/019.jpg
 */
#include <stdio.h>
#include <stdlib.h>
#include "overfly.h"

/* tiles/flight/camera.toml */
static const overfly_camera CAMERA = {320, 240, 400.0, {161.3, 118.9}, {-0.06, 0.015, 0.0004, -0.0003, 0.0}};
static unsigned char file_bytes[1 << 24];

static int failed(const char *what) {
    fprintf(stderr, "%s: error[%s]: %s\n", what, overfly_last_error_code(), overfly_last_error_message());
    return 1;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: fix STORE FRAME\n");
        return 2;
    }
    FILE *file = fopen(argv[2], "rb");
    if (!file) {
        perror(argv[2]);
        return 1;
    }
    size_t length = fread(file_bytes, 1, sizeof file_bytes, file);
    fclose(file);

    overfly_store *store;
    overfly_frame *frame;
    if (overfly_store_open(argv[1], &store) != OVERFLY_OK) return failed(argv[1]);
    if (overfly_frame_decode(file_bytes, length, &frame) != OVERFLY_OK) return failed(argv[2]);

    overfly_fix_request request = overfly_fix_request_new();
    request.latitude_deg = 48.4915, request.longitude_deg = 15.6160, request.sigma_m = 200;
    request.heading_deg = 271.6;
    request.camera = &CAMERA, request.height_m = 500.4, request.pitch_deg = 1.17, request.roll_deg = 0;
    request.attitude_sigma_deg = 0.1;
    overfly_fix fix;
    overfly_no_fix none;
    overfly_status status = overfly_locate(store, frame, &request, &fix, &none);
    if (status == OVERFLY_OK)
        printf("fix %.7f %.7f heading %.2f, %u windows agree\n", fix.latitude_deg, fix.longitude_deg, fix.heading_deg,
               fix.inliers);
    else if (status == OVERFLY_NO_FIX)
        printf("no fix: %s: %s\n", none.reason, none.detail);
    else
        failed("locate");

    overfly_frame_free(frame);
    overfly_store_free(store);
    return status == OVERFLY_OK ? 0 : status == OVERFLY_NO_FIX ? 3 : 1;
}
