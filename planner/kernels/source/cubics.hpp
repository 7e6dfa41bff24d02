// Motions of several joints in phases of constant jerk, read as cubics on common pieces.
#pragma once
#include "quadratic_program.hpp"

// Motions from state to state: durations (motions, joints, phases) and jerks of the phases, states (motions, joints, phases + 1)
// at their starts and at the end; wanted travels, velocities and accelerations (motions, joints) at the end.
struct PhasedMotions {
    int64_t motions, joints, phases;
    const double *position, *velocity, *acceleration, *jerk, *times, *travels, *end_velocity, *end_acceleration;
    double rounding;  // share of a motion's duration up to which two times count as one
};

// A matrix of three rows as the product of orthonormal rows and a triangle, by modified Gram-Schmidt, twice; a row that
// depends on the rows before it is left out.
struct ThreeRows {
    int64_t size;
    double *q[3], r[3][3];
    bool counts[3];

    void orthogonalise(double rounding) {
        for (int64_t k = 0; k < 3; k++) {
            const double before = sqrt(dot(q[k], q[k], size));
            for (int64_t i = 0; i < k; i++) r[k][i] = 0.0;
            for (int64_t time = 0; time < 2; time++)
                for (int64_t i = 0; i < k; i++) {
                    const double along = counts[i] ? dot(q[k], q[i], size) : 0.0;
                    r[k][i] += along;
                    for (int64_t n = 0; n < size; n++) q[k][n] -= along * q[i][n];
                }
            r[k][k] = sqrt(dot(q[k], q[k], size));
            counts[k] = r[k][k] > rounding * before;
            for (int64_t n = 0; n < size; n++) q[k][n] = counts[k] ? q[k][n] / r[k][k] : 0.0;
        }
    }
    // The least x (size) whose products with the rows are b.
    void least(const double b[3], double* x) const {
        double along[3];
        for (int64_t n = 0; n < size; n++) x[n] = 0.0;
        for (int64_t k = 0; k < 3; k++) {
            along[k] = b[k];
            for (int64_t i = 0; i < k; i++) along[k] -= r[k][i] * along[i];
            along[k] = counts[k] ? along[k] / r[k][k] : 0.0;
            for (int64_t n = 0; n < size; n++) x[n] += along[k] * q[k][n];
        }
    }
};

// Read the motions one after the other: lengths (pieces) and coefficients (pieces, joints, 4) with room for joints * phases
// pieces of each, and the number of pieces of each. Rounding leaves a difference between the end of a motion and the wanted
// state; the least change of the jerks removes it.
static inline int read_cubics(const PhasedMotions& in, int64_t* counts, double* lengths, double* coefficients) {
    const int64_t J = in.joints, P = in.phases, most = J * P + 2;
    Scratch<long double> ends(J * P), times(most);
    Scratch<double> effects(3 * most), jerks(most);
    if (!ends || !times || !effects || !jerks) return NO_MEMORY;
    for (int64_t m = 0; m < in.motions; m++) {
        const double* phase_times = in.times + m * J * P;
        long double duration = 0.0L;
        for (int64_t j = 0; j < J; j++) {
            long double at = 0.0L;  // a phase may be as short as 1e-8 of the whole
            for (int64_t p = 0; p < P; p++) ends[j * P + p] = at += phase_times[j * P + p];
            duration = at > duration ? at : duration;
        }
        int64_t found = 0;
        for (int64_t i = 0; i < J * P; i++)
            if (ends[i] < duration * (1.0 - in.rounding) && ends[i] > in.rounding * duration) times[found++] = ends[i];
        for (int64_t i = 1; i < found; i++)  // by insertion: each joint's ends are in order
            for (int64_t k = i; k > 0 && times[k - 1] > times[k]; k--) {
                const long double swap = times[k];
                times[k] = times[k - 1];
                times[k - 1] = swap;
            }
        times[found++] = duration;
        int64_t pieces = 0;
        long double start = 0.0L, last = 0.0L;
        for (int64_t i = 0; i < found; i++) {  // one that is within rounding of the time before it is left out
            const bool is_new = times[i] - last > in.rounding * duration;
            last = times[i];
            if (!is_new) continue;
            const long double middle = (start + last) / 2.0L;
            lengths[pieces] = (double)(last - start);
            for (int64_t j = 0; j < J; j++) {
                int64_t p = 0;
                while (p < P - 1 && middle > ends[j * P + p]) p++;
                const int64_t state = (m * J + j) * (P + 1) + p;
                const double s = (double)(start - (ends[j * P + p] - (long double)phase_times[j * P + p]));
                const double v = in.velocity[state], a = in.acceleration[state], jerk = in.jerk[(m * J + j) * P + p];
                double* c = coefficients + (pieces * J + j) * 4;
                c[0] = in.position[state] + s * (v + s * (a / 2.0 + s * jerk / 6.0));
                c[1] = v + s * (a + s * jerk / 2.0);
                c[2] = (a + s * jerk) / 2.0;
                c[3] = jerk / 6.0;
            }
            start = last;
            pieces++;
        }
        // The effect of 1 unit of jerk on each piece on position, velocity and acceleration at the end.
        double left = 0.0;
        ThreeRows rows{pieces, {effects.data, effects.data + most, effects.data + 2 * most}, {}, {}};
        for (int64_t i = pieces - 1; i >= 0; i--) {
            const double h = lengths[i];
            rows.q[0][i] = h * (h * h / 6.0 + left * (h + left) / 2.0);
            rows.q[1][i] = h * (h / 2.0 + left);
            rows.q[2][i] = h;
            left += h;
        }
        rows.orthogonalise(in.rounding);
        for (int64_t j = 0; j < J; j++) {
            const double *c = coefficients + ((pieces - 1) * J + j) * 4, t = lengths[pieces - 1];
            double missing[3] = {in.travels[m * J + j] - (c[0] + t * (c[1] + t * (c[2] + t * c[3]))),
                                 in.end_velocity[m * J + j] - (c[1] + t * (2.0 * c[2] + 3.0 * t * c[3])),
                                 in.end_acceleration[m * J + j] - (2.0 * c[2] + 6.0 * t * c[3])};
            bool has_jerk = false;
            for (int64_t i = 0; i < pieces; i++) has_jerk |= coefficients[(i * J + j) * 4 + 3] != 0.0;
            if (!has_jerk) missing[2] = 0.0;  // the acceleration jumps at the end
            rows.least(missing, jerks.data);
            double p = 0.0, v = 0.0, a = 0.0;  // of a motion from rest with these jerks
            for (int64_t i = 0; i < pieces; i++) {
                const double h = lengths[i], jerk = jerks[i];
                double* own = coefficients + (i * J + j) * 4;
                own[0] += p; own[1] += v; own[2] += a / 2.0; own[3] += jerk / 6.0;
                p += h * (v + h * (a / 2.0 + h * jerk / 6.0));
                v += h * (a + h * jerk / 2.0);
                a += h * jerk;
            }
        }
        counts[m] = pieces;
        lengths += pieces;
        coefficients += pieces * J * 4;
    }
    return OK;
}
