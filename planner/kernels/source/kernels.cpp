// The C interface of the kernels: arrays in, arrays out, and a code that says what failed. All arrays are in row order.
#include "serial_chain.hpp"
#if defined(__x86_64__)
#include <cpuid.h>
#endif

extern "C" {

// Whether the processor and the system have what x86-64-v3 adds: AVX2, FMA, BMI, F16C, LZCNT, MOVBE.
int runs_x86_64_v3() {
#if defined(__x86_64__)
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d)) return 0;
    const unsigned first = bit_FMA | bit_MOVBE | bit_OSXSAVE | bit_AVX | bit_F16C;
    if ((c & first) != first) return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6) return 0;  // the system keeps the wide registers
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return 0;
    const unsigned second = bit_AVX2 | bit_BMI | bit_BMI2;
    if ((b & second) != second) return 0;
    return __get_cpuid(0x80000001, &a, &b, &c, &d) && (c & bit_LZCNT);
#else
    return 0;
#endif
}

int inverse_dynamics(int64_t joints, const double* links, const double* gravity, int64_t states, const double* q,
                     const double* v, const double* a, double* tau) {
    Chain chain(joints, links, gravity);
    if (!chain) return NO_MEMORY;
    for (int64_t i = 0; i < states; i += W) {
        const int64_t at = i * joints, left = states - i;
        load_states(q + at, joints, left, chain.state(0));
        load_states(v + at, joints, left, chain.state(1));
        load_states(a + at, joints, left, chain.state(2));
        place(chain, chain.state(0));
        torques<true, true, true>(chain, chain.state(1), chain.state(2), chain.state(3));
        store_states(chain.state(3), joints, left, tau + at);
    }
    return OK;
}

int path_dynamics(int64_t joints, const double* links, const double* gravity, int64_t points, const double* q,
                  const double* first, const double* second, double* inertia, double* centripetal, double* still) {
    Chain chain(joints, links, gravity);
    if (!chain) return NO_MEMORY;
    for (int64_t i = 0; i < points; i += W) {
        const int64_t at = i * joints, left = points - i;
        load_states(q + at, joints, left, chain.state(0));
        load_states(first + at, joints, left, chain.state(1));
        load_states(second + at, joints, left, chain.state(2));
        place(chain, chain.state(0));
        torques<false, true, false>(chain, nullptr, chain.state(1), chain.state(3));
        store_states(chain.state(3), joints, left, inertia + at);
        torques<true, true, false>(chain, chain.state(1), chain.state(2), chain.state(3));
        store_states(chain.state(3), joints, left, centripetal + at);
        torques<false, false, true>(chain, nullptr, nullptr, chain.state(3));
        store_states(chain.state(3), joints, left, still + at);
    }
    return OK;
}
}
