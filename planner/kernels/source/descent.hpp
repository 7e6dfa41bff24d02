// Levenberg-Marquardt within a box, from many starts to many poses: four descents at a time, each as if it were alone.
#pragma once
#include "kinematics.hpp"

constexpr double DESCENDED = 1e-10;     // error (m, rad) at which a descent ends; its last step leaves far less
constexpr double DAMPING = 1e-3;         // share of the squared error that damps a step at first
constexpr double LEAST_DAMPING = 1e-13;  // share of the largest diagonal that is added: directions of a continuum go free
constexpr double MOST_DAMPING = 1e12;    // share of the squared error at which steps vanish
constexpr double LONGEST_STEP = 1.5;     // rad or m, the norm of a step: the Jacobian says nothing of what lies further away
constexpr double SLOW = 0.5;             // a step is slow when more than this share of the squared error is left
constexpr double NEAR_HALF_A_TURN = 0.1;  // sine of an angle near pi below which the axis is read from the symmetric part

// Where descents lead: positions (targets, 3) of a point, and rotations (targets, 3, 3) of the tip unless null.
struct Target { const double *positions, *rotations; };

// When they end: lower and upper limits (joints), slow steps in a row, steps, and the error that ends all that come later.
struct Terms { const double *lower, *upper; int64_t patience, most; double enough; };

// The logarithm of a rotation, row by row; of the two at half a turn that whose largest component is positive.
static inline void logarithm(const double* R, double* w) {
    for (int i = 0; i < 3; i++) {
        const int a = (i + 2) % 3, b = (i + 1) % 3;
        w[i] = 0.5 * (R[3 * a + b] - R[3 * b + a]);
    }
    const double sine = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), cosine = 0.5 * (R[0] + R[4] + R[8] - 1.0);
    const double angle = atan2(sine, cosine);
    if (cosine < 0.0 && sine < NEAR_HALF_A_TURN) {  // there the symmetric part, c 1 + (1 - c) a a^T, has the axis a
        int k = 0;
        for (int i = 1; i < 3; i++)
            if (R[4 * i] > R[4 * k]) k = i;
        double axis[3], norm = 0.0, along = 0.0;
        for (int i = 0; i < 3; i++) axis[i] = 0.5 * (R[3 * k + i] + R[3 * i + k]) - (i == k ? cosine : 0.0);
        for (int i = 0; i < 3; i++) norm += axis[i] * axis[i], along += axis[i] * w[i];
        for (int i = 0; i < 3; i++) w[i] = (along < 0.0 ? -angle : angle) / sqrt(norm) * axis[i];
    } else if (sine > 0.0) {
        for (int i = 0; i < 3; i++) w[i] *= angle / sine;
    }
}

// Four descents: where each is, what it lacks of its target, and how it has fared.
struct Descents {
    const Arm& arm;
    const Terms& terms;
    const int64_t n, rows;
    Scratch<V> memory;
    Scratch<Axis> axes;
    V *q, *candidate, *gradient, *J, *J_there, *normal;
    V error[6], squared, damping, slow, steps;
    V3 wanted;
    double turned[W][9];

    Descents(const Arm& arm, const Terms& terms, bool turns)
        : arm(arm), terms(terms), n(arm.joints), rows(turns ? 6 : 3), memory(n * (3 + 12 + n)), axes(n),
          squared(splat(INFINITY)), damping(splat(DAMPING)), slow(splat(0.0)), steps(splat(0.0)) {
        q = memory.data;
        candidate = q + n;
        gradient = candidate + n;
        J = gradient + n;
        J_there = J + 6 * n;
        normal = J_there + 6 * n;
    }
    explicit operator bool() const { return memory && axes; }

    // Put a start in place of one descent.
    void begin(int lane, const double* start, const double* position, const double* rotation) {
        for (int64_t j = 0; j < n; j++) candidate[j][lane] = start[j];
        wanted.x[lane] = position[0];
        wanted.y[lane] = position[1];
        wanted.z[lane] = position[2];
        if (rows == 6) memcpy(turned[lane], rotation, sizeof(turned[lane]));
        squared[lane] = INFINITY;
        damping[lane] = DAMPING;
        slow[lane] = steps[lane] = 0.0;
    }

    bool is_over(int lane) const {
        return squared[lane] < DESCENDED * DESCENDED || slow[lane] >= terms.patience || damping[lane] > MOST_DAMPING ||
               steps[lane] >= terms.most;
    }

    // Go to the candidates where these are nearer to their targets.
    void look() {
        V3 position;
        Matrix R;
        V there[6], sum = splat(0.0);
        reach(arm, candidate, position, R, axes.data);
        const V3 away = wanted - position;
        there[0] = away.x, there[1] = away.y, there[2] = away.z;
        for (int lane = 0; rows == 6 && lane < W; lane++) {
            double between[9], w[3];  // what the turn lacks, in the base's axes
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++) {
                    between[3 * r + c] = 0.0;
                    for (int k = 0; k < 3; k++) between[3 * r + c] += turned[lane][3 * r + k] * R.m[3 * c + k][lane];
                }
            logarithm(between, w);
            for (int i = 0; i < 3; i++) there[3 + i][lane] = w[i];
        }
        for (int64_t r = 0; r < rows; r++) sum += there[r] * there[r];
        for (int64_t j = 0; j < n; j++) {
            V3 linear, angular;
            column(arm.frames[j], axes[j], position, linear, angular);
            const V parts[6] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
            for (int64_t r = 0; r < rows; r++) J_there[r * n + j] = parts[r];
        }
        const VI better = sum < squared;
        slow = select(sum > splat(SLOW) * squared, slow + splat(1.0), splat(0.0));
        const V less = damping * splat(0.25), first = splat(DAMPING);
        damping = select(better, select(less > first, less, first), damping * splat(16.0));
        squared = select(better, sum, squared);
        for (int64_t j = 0; j < n; j++) q[j] = select(better, candidate[j], q[j]);
        for (int64_t r = 0; r < rows; r++) error[r] = select(better, there[r], error[r]);
        for (int64_t i = 0; i < rows * n; i++) J[i] = select(better, J_there[i], J[i]);
    }

    // Set the candidates a damped Newton step ahead, without the joints that it would press against their limits.
    void step() {
        const V none = splat(0.0), one = splat(1.0);
        V largest = none;
        for (int64_t j = 0; j < n; j++) {
            V g = none;
            for (int64_t r = 0; r < rows; r++) g += J[r * n + j] * error[r];
            const VI pressed = ((q[j] <= splat(terms.lower[j])) & (g < none)) | ((q[j] >= splat(terms.upper[j])) & (g > none));
            gradient[j] = select(pressed, none, g);
            for (int64_t r = 0; r < rows; r++) J_there[r * n + j] = select(pressed, none, J[r * n + j]);
        }
        for (int64_t j = 0; j < n; j++)
            for (int64_t k = 0; k <= j; k++) {
                V sum = none;
                for (int64_t r = 0; r < rows; r++) sum += J_there[r * n + j] * J_there[r * n + k];
                normal[j * n + k] = sum;
                if (j == k) largest = select(sum > largest, sum, largest);
            }
        const V added = damping * select(squared < one, squared, one) + splat(LEAST_DAMPING) * (one + largest);
        for (int64_t j = 0; j < n; j++) normal[j * n + j] += added;
        solve();
        V length = none;
        for (int64_t j = 0; j < n; j++) length += gradient[j] * gradient[j];
        V share = one;
        for (int lane = 0; lane < W; lane++)
            if (const double l = sqrt(length[lane]); l > LONGEST_STEP) share[lane] = LONGEST_STEP / l;
        for (int64_t j = 0; j < n; j++) {
            const V low = splat(terms.lower[j]), high = splat(terms.upper[j]);
            V ahead = q[j] + share * gradient[j];
            ahead = select(ahead < low, low, ahead);
            candidate[j] = select(ahead > high, high, ahead);
        }
        steps += one;
    }

    // Solve the normal equations in place of the gradient, by L D L^T (the lower triangle has L, the diagonal D).
    void solve() {
        for (int64_t j = 0; j < n; j++) {
            for (int64_t i = j; i < n; i++) {
                V sum = normal[i * n + j];
                for (int64_t k = 0; k < j; k++) sum -= normal[i * n + k] * normal[j * n + k] * normal[k * n + k];
                normal[i * n + j] = i == j ? sum : sum / normal[j * n + j];
            }
            for (int64_t k = 0; k < j; k++) gradient[j] -= normal[j * n + k] * gradient[k];
        }
        for (int64_t j = n - 1; j >= 0; j--) {
            gradient[j] /= normal[j * n + j];
            for (int64_t k = j + 1; k < n; k++) gradient[j] -= normal[k * n + j] * gradient[k];
        }
    }
};

// Descend from starts (count, joints), so many of them to each target: errors (count) and where they end, (count, joints).
// Behind the first that reaches `enough` none begins, and those under way are left: their errors stay as they were.
static inline int descend_all(const Arm& arm, const Terms& terms, const Target& target, int64_t count, int64_t each,
                              const double* starts, double* errors, double* ends) {
    const int64_t n = arm.joints;
    Descents descents(arm, terms, target.rotations != nullptr);
    if (!descents) return NO_MEMORY;
    int64_t next = 0, last = count, row[W];
    auto begin = [&](int lane) {
        row[lane] = next < last ? next++ : -1;
        const int64_t at = row[lane] < 0 ? 0 : row[lane], to = at / each;
        descents.begin(lane, starts + at * n, target.positions + 3 * to, target.rotations + 9 * to);
        return row[lane] >= 0;
    };
    if (count <= 0) return OK;
    int going = 0;
    for (int lane = 0; lane < W; lane++) going += begin(lane);
    while (going > 0) {
        descents.look();
        bool over[W];
        for (int lane = 0; lane < W; lane++) {
            over[lane] = row[lane] >= 0 && descents.is_over(lane);
            if (!over[lane]) continue;
            const int64_t at = row[lane];
            errors[at] = sqrt(descents.squared[lane]);
            for (int64_t j = 0; j < n; j++) ends[at * n + j] = descents.q[j][lane];
            if (errors[at] <= terms.enough && at < last) last = at;
        }
        descents.step();
        for (int lane = 0; lane < W; lane++)
            if (over[lane] || row[lane] > last) going += begin(lane) - 1;
    }
    return OK;
}
