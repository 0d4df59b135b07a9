component pretravel_probe """A touch-trigger probe whose pretravel depends on direction, and what it touches.

The tip is a ball at the end of the tool. It touches spheres, boxes and rings (tori) whose
places are parameters, in machine coordinates. The probe trips when the ball, were the stylus
straight, would be as deep in the surface as the pretravel in the direction of the normal there.
All that it touches stands on a rotary axis, which stands still where the pin table is not connected.
""";

pin in float x_cmd "commanded position of the spindle, mm";
pin in float y_cmd;
pin in float z_cmd;
pin in float table "position of the rotary axis, degrees";
pin out float x_fb "what the machine measures: the commanded position, or where it was latched";
pin out float y_fb;
pin out float z_fb;
pin out bit tripped;
pin out float depth "of the straight tip in the surface, mm";
pin out float largest_depth "the largest depth so far, mm";

param rw s32 fault = 0 "0 none, 1 never trips, 2 stays tripped after a touch, 3 trips early, 4 is tripped always, 5 bounces, 6 trips late, 7 trips early for 2 ms, 8 chatters in contact, 9 opens for good in contact, 10 closes for good after the way back, 11 is knocked in the air for 20 ms, 12 loses one touch";
param rw s32 fault_after = 0 "touches before the fault";
param rw float fault_size = 1.7 "faults 3, 6, 7: distance from the place of the trigger, mm; 11: at least so far from everything";

param rw float tip_radius = 3.0;
param rw float length = 0.0 "from the spindle's reference point down to the tip's centre, mm";
param rw bit hardware_latch = 1 "latch the place of the trigger itself, not of the next cycle";

param rw float axial = 0.001 "pretravel along the axis, mm";
param rw float across = 0.008 "added across the axis, by the squared sine of the polar angle, mm";
param rw float lobe = 0.003 "amplitude of three lobes, mm";
param rw float lobe_azimuth = 20.0 "degrees";
param rw float second = 0.0005 "amplitude of six lobes, mm";
param rw float oval = 0.0008 "amplitude of two lobes: an uneven tripod, mm";
param rw float oval_azimuth = 55.0 "degrees";
param rw float noise = 0.0 "largest random part of the pretravel, mm";

param rw s32 kind-#[8] "0 nothing, 1 sphere, 2 box, 3 ring";
param rw float x-#[8] "centre, mm";
param rw float y-#[8];
param rw float z-#[8];
param rw float a-#[8] "sphere: radius; box: half length in x; ring: radius of its circle, mm";
param rw float b-#[8] "box: half length in y; ring: radius of its tube, mm";
param rw float c-#[8] "box: half height, mm";
param rw float turn-#[8] "box: about z, degrees";
param rw float tilt-#[8] "box: then about its own x axis, degrees";

param rw float axis_x "a place on the rotary axis, mm";
param rw float axis_y;
param rw float axis_z;
param rw float axis_i = 0.0 "direction of the rotary axis, of any length";
param rw float axis_j = 0.0;
param rw float axis_k = 1.0;
param rw s32 axis_sense = -1 "-1: turns against the angle, right-handed about the direction; 1: with it";

variable double last_x;
variable double last_y;
variable double last_z;
variable int started;
variable rtapi_u32 seed = 1234567;
variable double scatter;
variable int touches;
variable int bounces;
variable int cycles;
variable int broken;

option extra_setup no;
function _ fp;
license "MIT";
author "The pretravel contributors";
;;

#include <rtapi_math.h>

#define DEGREE 0.017453292519943295

/* Distance of a point from one shape, and the outward unit normal there. */
static double shape_distance(int kind, double a, double b, double c, double turn, double tilt,
                             double x, double y, double z, double *n)
{
    double size, rho, gap;
    if (kind == 1) {
        size = sqrt(x * x + y * y + z * z);
        n[0] = x / size; n[1] = y / size; n[2] = z / size;
        return size - a;
    }
    if (kind == 3) {
        rho = sqrt(x * x + y * y);
        gap = rho - a;
        size = sqrt(gap * gap + z * z);
        n[0] = gap / size * x / rho; n[1] = gap / size * y / rho; n[2] = z / size;
        return size - b;
    }
    {
        double ct = cos(turn * DEGREE), st = sin(turn * DEGREE);
        double cu = cos(tilt * DEGREE), su = sin(tilt * DEGREE);
        double u = ct * x + st * y, v0 = -st * x + ct * y;
        double v = cu * v0 + su * z, w = -su * v0 + cu * z;
        double half[3] = {a, b, c}, p[3] = {u, v, w}, out[3], m[3] = {0, 0, 0};
        double outside = 0.0, deepest = -1e30, result;
        int i, nearest = 0;
        for (i = 0; i < 3; i++) {
            double over = fabs(p[i]) - half[i];
            out[i] = over > 0.0 ? over : 0.0;
            outside += out[i] * out[i];
            if (over > deepest) { deepest = over; nearest = i; }
        }
        if (outside > 0.0) {
            result = sqrt(outside);
            for (i = 0; i < 3; i++) m[i] = out[i] / result * (p[i] < 0.0 ? -1.0 : 1.0);
        } else {
            result = deepest;
            m[nearest] = p[nearest] < 0.0 ? -1.0 : 1.0;
        }
        v0 = cu * m[1] - su * m[2];
        n[2] = su * m[1] + cu * m[2];
        n[0] = ct * m[0] - st * v0;
        n[1] = st * m[0] + ct * v0;
        return result;
    }
}

/* A vector turned about the rotary axis (Rodrigues), degrees. */
#define TURNED(v, angle) turned(__comp_inst, v, angle)
static void turned(struct __comp_state *__comp_inst, double *v, double angle)
{
    double size = sqrt(axis_i * axis_i + axis_j * axis_j + axis_k * axis_k);
    double u[3] = {axis_i / size, axis_j / size, axis_k / size};
    double cosine = cos(angle * DEGREE), sine = sin(angle * DEGREE);
    double along = (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) * (1.0 - cosine);
    double w[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    int i;
    for (i = 0; i < 3; i++) v[i] = cosine * v[i] + sine * w[i] + along * u[i];
}

/* How much deeper than at the trigger the straight tip is. */
#define DEEPER(px, py, pz) deeper(__comp_inst, px, py, pz)
static double deeper(struct __comp_state *__comp_inst, double px, double py, double pz)
{
    double nearest = 1e30, n[3] = {0, 0, 1}, m[3], sine2, azimuth, pretravel;
    double on_table[3] = {px - axis_x, py - axis_y, pz - length - axis_z};
    int i;
    TURNED(on_table, -axis_sense * table);
    px = on_table[0] + axis_x; py = on_table[1] + axis_y; pz = on_table[2] + axis_z;
    for (i = 0; i < 8; i++) {
        double d;
        if (kind(i) == 0) continue;
        d = shape_distance(kind(i), a(i), b(i), c(i), turn(i), tilt(i),
                           px - x(i), py - y(i), pz - z(i), m);
        if (d < nearest) { nearest = d; n[0] = m[0]; n[1] = m[1]; n[2] = m[2]; }
    }
    TURNED(n, axis_sense * table);
    sine2 = n[0] * n[0] + n[1] * n[1];
    azimuth = sine2 > 0.0 ? atan2(n[1], n[0]) : 0.0;
    pretravel = axial + scatter + across * sine2
        + lobe * sine2 * sqrt(sine2) * cos(3.0 * (azimuth - lobe_azimuth * DEGREE))
        + second * sine2 * sine2 * sine2 * cos(6.0 * (azimuth - lobe_azimuth * DEGREE))
        + oval * sine2 * cos(2.0 * (azimuth - oval_azimuth * DEGREE));
    return (tip_radius - nearest) - pretravel;
}

/* What the probe would signal, with its fault. Closed: the straight tip is deep enough. */
#define SIGNAL(now) signalled(__comp_inst, now)
static int signalled(struct __comp_state *__comp_inst, double now)
{
    int closed = tripped ? now >= -0.0005 : now >= 0.0;
    int active = touches >= fault_after;
    if (fault == 4) return 1;
    if (!active) return closed;
    switch (fault) {
    case 1: return 0;
    case 2: return closed || tripped;
    case 3: return now >= (tripped ? -0.0005 : 0.0) - (touches == fault_after ? fault_size : 0.0);
    case 5:
        /* Opened: closed again for 3 ms after 5 ms, twice. */
        if (closed) { bounces = 2; cycles = 0; return 1; }
        if (bounces == 0) return 0;
        cycles++;
        if (cycles <= 5) return 0;
        if (cycles <= 8) return 1;
        bounces--; cycles = 0;
        return 0;
    case 6: return now >= fault_size - (tripped ? 0.0005 : 0.0);
    case 7:
        if (touches == fault_after && now >= -fault_size && cycles < 2) { cycles++; return 1; }
        return closed;
    case 8:
        /* 2 ms closed, 2 ms open. */
        if (!closed && now < 0.0) return 0;
        return (cycles++ / 2) % 2 == 0;
    case 9:
        if (broken || !closed) return 0;
        if (++cycles > 6) broken = 1;
        return 1;
    case 10:
        if (broken) return 1;
        if (closed) cycles = 1;
        else if (cycles && ++cycles > 8) broken = 1;
        return closed;
    case 11:
        if (touches == fault_after && now < -fault_size && cycles < 20) { cycles++; return 1; }
        return closed;
    case 12:
        if (touches > fault_after) return closed;
        if (now >= 0.0) broken = 1;
        else if (broken && now < -0.0005) touches++;
        return 0;
    }
    return closed;
}

FUNCTION(_) {
    double now;
    int closed;
    if (!started) { last_x = x_cmd; last_y = y_cmd; last_z = z_cmd; started = 1; largest_depth = -1e30; }
    now = DEEPER(x_cmd, y_cmd, z_cmd);
    depth = now;
    if (now > largest_depth) largest_depth = now;
    x_fb = x_cmd; y_fb = y_cmd; z_fb = z_cmd;
    closed = SIGNAL(now);
    if (closed && !tripped) {
        if (now >= 0.0 && hardware_latch && DEEPER(last_x, last_y, last_z) < 0.0) {
            double low = 0.0, high = 1.0;
            int i;
            for (i = 0; i < 60; i++) {
                double t = 0.5 * (low + high);
                if (DEEPER(last_x + t * (x_cmd - last_x), last_y + t * (y_cmd - last_y),
                           last_z + t * (z_cmd - last_z)) >= 0.0) high = t; else low = t;
            }
            x_fb = last_x + high * (x_cmd - last_x);
            y_fb = last_y + high * (y_cmd - last_y);
            z_fb = last_z + high * (z_cmd - last_z);
        }
        tripped = 1;
    } else if (!closed && tripped) {
        tripped = 0;
        touches++;
        seed ^= seed << 13; seed ^= seed >> 17; seed ^= seed << 5;
        scatter = noise * (2.0 * (seed / 4294967295.0) - 1.0);
    }
    last_x = x_cmd; last_y = y_cmd; last_z = z_cmd;
}
