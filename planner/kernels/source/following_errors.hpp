// How much the motion of the tool may differ where joints are off their planned positions by following errors. A derivative of the
// tool's position by positions of joints, of any order, is no longer than the lever of the last of these joints: each axis
// before it only turns the rest. Derivatives by time are sums of them, see docs/certificate.md.
#pragma once
#include <stdint.h>

// The following errors of joints, the largest distances of the tool from their axes (1 for joints that slide), and whether they
// turn (1, 0); null: there are none.
struct FollowingErrors { const double *errors, *levers, *turns; };

// The largest difference of a derivative by time (order 1 to 3) of the tool's position, or of its turn, by magnitudes of
// velocities, accelerations and jerks (order, joints) of the joints that move it.
static inline double tool_difference(const FollowingErrors& of, int64_t joints, int order, bool is_angular, const double* rates, int64_t stride) {
    double error = 0.0, v = 0.0, a = 0.0, j = 0.0, before = 0.0, sum = 0.0;
    for (int64_t i = 0; i < joints; i++) {
        const double speed = rates[i], gain = order > 1 ? rates[stride + i] : 0.0, jerk = order > 2 ? rates[2 * stride + i] : 0.0;
        if (is_angular) {
            if (of.turns[i] == 0.0) continue;
            sum += error * (order == 1 ? speed : order == 2 ? gain + speed * v : jerk + 2.0 * gain * v + speed * (a + v * v));
        }
        error += of.errors[i]; v += speed; a += gain; j += jerk;
        if (is_angular) continue;
        const double all = error * (order == 1 ? v : order == 2 ? a + v * v : j + 3.0 * a * v + v * v * v);
        sum += of.levers[i] * (all - before);
        before = all;
    }
    return sum;
}
