// Taylor models (Makino and Berz 2003) of functions on four intervals at once: a polynomial in x from -1 to 1, and how far
// the function is from it at most, rounding included (docs/certificate.md).
#pragma once
#include "vectors.hpp"

constexpr int DEGREE = 5, TERMS = DEGREE + 1;
constexpr double UNIT = 1.1102230246251565e-16;      // the rounding of one operation, 2^-53
constexpr double OF_PRODUCT = (TERMS + 2) * UNIT;    // of a coefficient of a product, by the product of the sums of terms
constexpr double OF_SINE = 64.0 * UNIT;              // of the coefficients of sine and cosine: they sum to less than e
constexpr double OF_SUMS = 1.0 + 1e-9;               // on a remainder: what it is off by its own rounding

static inline V magnitude(V a) { return (V)((VI)a & 0x7fffffffffffffffLL); }
static inline V larger(V a, V b) { return select(a > b, a, b); }

// The function is within `rest` of sum c_k x^k; `size` is at least the sum of the |c_k|.
struct Taylor { V c[TERMS], size, rest; };

template <> inline Taylor number<Taylor>(double x) {
    Taylor t{};
    t.c[0] = splat(x);
    t.size = splat(fabs(x));
    return t;
}
static inline Taylor operator+(const Taylor& a, const Taylor& b) {
    Taylor s;
    for (int k = 0; k < TERMS; k++) s.c[k] = a.c[k] + b.c[k];
    s.size = a.size + b.size;
    s.rest = a.rest + b.rest + splat(UNIT) * s.size;
    return s;
}
static inline Taylor operator-(const Taylor& a, const Taylor& b) {
    Taylor s;
    for (int k = 0; k < TERMS; k++) s.c[k] = a.c[k] - b.c[k];
    s.size = a.size + b.size;
    s.rest = a.rest + b.rest + splat(UNIT) * s.size;
    return s;
}
static inline Taylor scaled(double by, const Taylor& a) {
    Taylor s;
    const V f = splat(by), g = splat(fabs(by));
    for (int k = 0; k < TERMS; k++) s.c[k] = f * a.c[k];
    s.size = g * a.size;
    s.rest = g * a.rest + splat(UNIT) * s.size;
    return s;
}
// The product: terms beyond the degree go to the rest.
__attribute__((noinline)) static Taylor operator*(const Taylor& a, const Taylor& b) {
    V A[TERMS], tail[TERMS + 1], of_a = splat(0.0), beyond = splat(0.0);
    tail[TERMS] = splat(0.0);
    for (int k = DEGREE; k >= 0; k--) {
        A[k] = magnitude(a.c[k]);
        of_a += A[k];
        tail[k] = tail[k + 1] + magnitude(b.c[k]);
    }
    Taylor p;
    for (int k = 0; k < TERMS; k++) {
        V sum = a.c[0] * b.c[k];
        for (int i = 1; i <= k; i++) sum += a.c[i] * b.c[k - i];
        p.c[k] = sum;
    }
    for (int k = 1; k < TERMS; k++) beyond += A[k] * tail[TERMS - k];
    p.size = of_a * tail[0];
    p.rest = a.rest * (tail[0] + b.rest) + b.rest * of_a + beyond + splat(OF_PRODUCT) * p.size;
    return p;
}

// Sine and cosine of a model: the Taylor coefficients of its polynomial, and what comes after them at most.
static inline void sine_cosine(const Taylor& q, Taylor& s, Taylor& c) {
    sine_cosine(q.c[0], s.c[0], c.c[0]);
    V most[TERMS], reach = splat(0.0), sum;  // of exp(sum |q_k| x^k), whose coefficients are at least as large
    most[0] = sum = splat(1.0);
    for (int k = 1; k < TERMS; k++) {
        V of_s = splat(0.0), of_c = splat(0.0), of_most = splat(0.0);
        for (int i = 1; i <= k; i++) {
            const V slope = splat((double)i / (double)k) * q.c[i];
            of_s += slope * c.c[k - i];
            of_c -= slope * s.c[k - i];
            of_most += magnitude(slope) * most[k - i];
        }
        s.c[k] = of_s;
        c.c[k] = of_c;
        most[k] = of_most;
        sum += of_most;
        reach += magnitude(q.c[k]);
    }
    V power = splat(1.0);  // exp(reach) up to reach 1, beyond which no remainder is known
    for (int k = 16; k > 0; k--) power = power * reach / splat((double)k) + splat(1.0);
    const V tail = larger(power - sum, splat(0.0)) + splat(OF_SINE) + q.rest;
    s.rest = c.rest = select(reach <= splat(1.0), tail, splat(INFINITY));
    s.size = c.size = sum;
}
