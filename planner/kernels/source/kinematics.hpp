// Where the joints of an arm bring a point of its tip, and how it moves, four joint positions at a time.
#pragma once
#include "vectors.hpp"

struct ArmFrame {  // ARM_FRAME_NUMBERS of planner/kernels/kinematics.py
    double rotation[9], origin[3], turns;
};

// An arm whose joints turn about, or slide along, the z axes of their frames; the last frame is that of the tip.
struct Arm { int64_t joints; const ArmFrame* frames; const double* point; };

// The axis of a joint and a point on it, in the base's axes.
struct Axis { V3 along, through; };

static inline V3 operator*(V s, V3 a) { return {s * a.x, s * a.y, s * a.z}; }
static inline V dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Turn the columns of a matrix by a constant rotation, R C, and by a joint about its z axis.
static inline Matrix times(const Matrix& R, const double* c) {
    Matrix out;
    for (int r = 0; r < 9; r += 3)
        for (int k = 0; k < 3; k++)
            out.m[r + k] = R.m[r] * splat(c[k]) + R.m[r + 1] * splat(c[3 + k]) + R.m[r + 2] * splat(c[6 + k]);
    return out;
}
static inline void turn_about_z(Matrix& R, V angle) {
    V s, c;
    sine_cosine(angle, s, c);
    for (int r = 0; r < 9; r += 3) {
        const V a = R.m[r], b = R.m[r + 1];
        R.m[r] = a * c + b * s;
        R.m[r + 1] = b * c - a * s;
    }
}
static inline Matrix unit_matrix() {
    Matrix R;
    for (int r = 0; r < 9; r++) R.m[r] = splat(r % 4 ? 0.0 : 1.0);
    return R;
}

// Where the point is and how the tip is turned; `axes` (joints) is filled unless it is null.
static inline void reach(const Arm& arm, const V* q, V3& position, Matrix& R, Axis* axes) {
    R = unit_matrix();
    position = {splat(0.0), splat(0.0), splat(0.0)};
    for (int64_t i = 0; i <= arm.joints; i++) {
        const ArmFrame& frame = arm.frames[i];
        position = position + R * constant(frame.origin);
        R = times(R, frame.rotation);
        if (i == arm.joints) break;
        const V3 along{R.m[2], R.m[5], R.m[8]};
        if (axes) axes[i] = {along, position};
        if (frame.turns != 0.0) turn_about_z(R, q[i]);
        else position = position + q[i] * along;
    }
    position = position + R * constant(arm.point);
}

// The column of the Jacobian of one joint: what it adds to the velocities of the point and of the turn.
static inline void column(const ArmFrame& frame, const Axis& axis, V3 position, V3& linear, V3& angular) {
    const V none = splat(0.0);
    linear = frame.turns != 0.0 ? cross(axis.along, position - axis.through) : axis.along;
    angular = frame.turns != 0.0 ? axis.along : V3{none, none, none};
}

// How a body turns: its angular velocity and the two derivatives of that by time.
struct Turning { V3 speed, gain, jerk; };

// The derivative of some order by time of a vector that is fixed to a turning body.
template <int ORDER> static inline V3 carried(const Turning& w, V3 r, V3& first, V3& second) {
    first = cross(w.speed, r);
    if (ORDER == 1) return first;
    second = cross(w.gain, r) + cross(w.speed, first);
    if (ORDER == 2) return second;
    return cross(w.jerk, r) + 2.0 * cross(w.gain, first) + cross(w.speed, second);
}

// The derivatives of an order, 1 to 3, by time of the point's position and of the tip's turn; `a` and `j` matter from
// orders 2 and 3 on.
template <int ORDER>
static inline void rates(const Arm& arm, const V* q, const V* v, const V* a, const V* j, V3& linear, V3& angular) {
    const V3 none{splat(0.0), splat(0.0), splat(0.0)};
    Turning w{none, none, none};
    Matrix R = unit_matrix();
    V3 first = none, second = none;
    linear = none;
    for (int64_t i = 0; i <= arm.joints; i++) {
        const ArmFrame& frame = arm.frames[i];
        linear = linear + carried<ORDER>(w, R * constant(frame.origin), first, second);
        R = times(R, frame.rotation);
        if (i == arm.joints) break;
        const V3 along{R.m[2], R.m[5], R.m[8]};
        const V3 third = carried<ORDER>(w, along, first, second);
        if (frame.turns == 0.0) {
            if (ORDER == 1) linear = linear + v[i] * along + q[i] * first;
            if (ORDER == 2) linear = linear + a[i] * along + 2.0 * (v[i] * first) + q[i] * second;
            if (ORDER == 3) linear = linear + j[i] * along + 3.0 * (a[i] * first + v[i] * second) + q[i] * third;
            continue;
        }
        w.speed = w.speed + v[i] * along;
        if (ORDER >= 2) w.gain = w.gain + a[i] * along + v[i] * first;
        if (ORDER == 3) w.jerk = w.jerk + j[i] * along + 2.0 * (a[i] * first) + v[i] * second;
        turn_about_z(R, q[i]);
    }
    linear = linear + carried<ORDER>(w, R * constant(arm.point), first, second);
    angular = ORDER == 1 ? w.speed : ORDER == 2 ? w.gain : w.jerk;
}

// Vectors (count, 3) of up to four states.
static inline void store_vectors(V3 vector, int64_t count, double* rows) {
    const V parts[3] = {vector.x, vector.y, vector.z};
    store_states(parts, 3, count, rows);
}

static inline int reach_all(const Arm& arm, int64_t states, const double* q, double* positions, double* rotations,
                            double* jacobians) {
    const int64_t n = arm.joints;
    Scratch<V> at(n);
    Scratch<Axis> axes(n);
    Scratch<V> columns(6 * n);
    if (!at || !axes || !columns) return NO_MEMORY;
    for (int64_t i = 0; i < states; i += W) {
        const int64_t left = states - i;
        V3 position;
        Matrix R;
        load_states(q + i * n, n, left, at.data);
        reach(arm, at.data, position, R, jacobians ? axes.data : nullptr);
        store_vectors(position, left, positions + 3 * i);
        store_states(R.m, 9, left, rotations + 9 * i);
        if (!jacobians) continue;
        for (int64_t j = 0; j < n; j++) {
            V3 linear, angular;
            column(arm.frames[j], axes[j], position, linear, angular);
            const V parts[6] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
            for (int64_t r = 0; r < 6; r++) columns[r * n + j] = parts[r];
        }
        store_states(columns.data, 6 * n, left, jacobians + 6 * n * i);
    }
    return OK;
}

template <int ORDER>
static inline int rates_all(const Arm& arm, int64_t states, const double* q, const double* const* motion, double* linear,
                            double* angular) {
    const int64_t n = arm.joints;
    Scratch<V> at(4 * n);
    if (!at) return NO_MEMORY;
    for (int64_t i = 0; i < states; i += W) {
        const int64_t left = states - i;
        load_states(q + i * n, n, left, at.data);
        for (int64_t k = 0; k < ORDER; k++) load_states(motion[k] + i * n, n, left, at.data + (k + 1) * n);
        V3 of_point, of_turn;
        rates<ORDER>(arm, at.data, at.data + n, at.data + 2 * n, at.data + 3 * n, of_point, of_turn);
        store_vectors(of_point, left, linear + 3 * i);
        store_vectors(of_turn, left, angular + 3 * i);
    }
    return OK;
}
