// Four numbers at a time, of four states or four joints, and what is computed with them.
#pragma once
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef double V __attribute__((vector_size(32)));
typedef long long VI __attribute__((vector_size(32)));
constexpr int64_t W = 4;

constexpr int OK = 0, NO_MEMORY = 1;

// Memory for a kernel, freed at its end; null if there is none.
template <class T> struct Scratch {
    T* data;
    explicit Scratch(int64_t count) : data(static_cast<T*>(aligned_alloc(64, (count * sizeof(T) / 64 + 1) * 64))) {}
    ~Scratch() { free(data); }
    Scratch(const Scratch&) = delete;
    T& operator[](int64_t i) { return data[i]; }
    explicit operator bool() const { return data != nullptr; }
};

static inline V splat(double x) { return V{x, x, x, x}; }
static inline V select(VI mask, V a, V b) { return (V)((mask & (VI)a) | (~mask & (VI)b)); }

// Sine and cosine to about one unit in the last place (Cephes' polynomials, reduction by Cody and Waite).
static inline void sine_cosine(V x, V& s, V& c) {
    constexpr double LARGEST = 1e5;  // beyond it the reduction loses digits
    const V rounding = splat(6755399441055744.0);  // 1.5 * 2^52: adding it rounds to an integer in the last bits
    V turns = x * splat(0.63661977236758134308) + rounding;
    VI quadrant = (VI)turns;
    turns = turns - rounding;
    V r = ((x - turns * splat(1.57079625129699707031)) - turns * splat(7.54978941586159635335e-8)) -
          turns * splat(5.39030285815811905290e-15);
    V z = r * r;
    V ps = (((((splat(1.58962301576546568060e-10) * z - splat(2.50507477628578072866e-8)) * z +
               splat(2.75573136213857245213e-6)) * z - splat(1.98412698295895385996e-4)) * z +
             splat(8.33333333332211858878e-3)) * z - splat(1.66666666666666307295e-1)) * z * r + r;
    V pc = (((((splat(-1.13585365213876817300e-11) * z + splat(2.08757008419747316778e-9)) * z -
               splat(2.75573141792967388112e-7)) * z + splat(2.48015872888517045348e-5)) * z -
             splat(1.38888888888730564116e-3)) * z + splat(4.16666666666665929218e-2)) * z * z -
           splat(0.5) * z + splat(1.0);
    VI swapped = (quadrant & 1) != 0, minus_s = (quadrant & 2) != 0, minus_c = ((quadrant + 1) & 2) != 0;
    V a = select(swapped, pc, ps), b = select(swapped, ps, pc);
    s = select(minus_s, -a, a);
    c = select(minus_c, -b, b);
    for (int k = 0; k < W; k++)
        if (!(x[k] >= -LARGEST && x[k] <= LARGEST)) { s[k] = sin(x[k]); c[k] = cos(x[k]); }
}

// A product with a constant: for every kind of number that serial chains are computed with.
static inline V scaled(double s, V a) { return splat(s) * a; }

template <class S> struct Vector { S x, y, z; };
typedef Vector<V> V3;
template <class S> static inline Vector<S> operator+(const Vector<S>& a, const Vector<S>& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class S> static inline Vector<S> operator-(const Vector<S>& a, const Vector<S>& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class S> static inline Vector<S> operator*(double s, const Vector<S>& a) { return {scaled(s, a.x), scaled(s, a.y), scaled(s, a.z)}; }
template <class S> static inline Vector<S> cross(const Vector<S>& a, const Vector<S>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class S> static inline Vector<S> cross(const Vector<S>& a, const double* b) {
    return {scaled(b[2], a.y) - scaled(b[1], a.z), scaled(b[0], a.z) - scaled(b[2], a.x), scaled(b[1], a.x) - scaled(b[0], a.y)};
}
template <class S> static inline S number(double x);
template <> inline V number<V>(double x) { return splat(x); }
template <class S = V> static inline Vector<S> constant(const double* v) { return {number<S>(v[0]), number<S>(v[1]), number<S>(v[2])}; }
template <class S> static inline Vector<S> product(const double* m, const Vector<S>& v) {  // of a constant matrix, row by row
    return {scaled(m[0], v.x) + scaled(m[1], v.y) + scaled(m[2], v.z),
            scaled(m[3], v.x) + scaled(m[4], v.y) + scaled(m[5], v.z),
            scaled(m[6], v.x) + scaled(m[7], v.y) + scaled(m[8], v.z)};
}

struct Matrix { V m[9]; };
static inline V3 operator*(const Matrix& R, const V3& v) {
    return {R.m[0] * v.x + R.m[1] * v.y + R.m[2] * v.z, R.m[3] * v.x + R.m[4] * v.y + R.m[5] * v.z,
            R.m[6] * v.x + R.m[7] * v.y + R.m[8] * v.z};
}
static inline V3 transposed(const Matrix& R, const V3& v) {
    return {R.m[0] * v.x + R.m[3] * v.y + R.m[6] * v.z, R.m[1] * v.x + R.m[4] * v.y + R.m[7] * v.z,
            R.m[2] * v.x + R.m[5] * v.y + R.m[8] * v.z};
}

// Rows (count, joints) of up to four states as one vector for each joint; lanes without a state repeat the last one.
static inline void load_states(const double* rows, int64_t joints, int64_t count, V* out) {
    for (int64_t j = 0; j < joints; j++)
        for (int64_t k = 0; k < W; k++) out[j][k] = rows[(k < count ? k : count - 1) * joints + j];
}
static inline void store_states(const V* in, int64_t joints, int64_t count, double* rows) {
    for (int64_t k = 0; k < W && k < count; k++)
        for (int64_t j = 0; j < joints; j++) rows[k * joints + j] = in[j][k];
}
