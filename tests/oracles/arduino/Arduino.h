// As much of Arduino as a sketch of examples/devices needs, so that a C++ compiler can judge it and run it: with
// an MPU-6050 on its bus that turns by 90 degrees a second about z, in the counts of its data sheet.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>

inline uint32_t &clock_us() {
  // It wraps on the way.
  static uint32_t us = 0u - 400000u;
  return us;
}

inline uint32_t micros() { return clock_us() += 40; }

struct SerialPort {
  void begin(unsigned long baud) {
    if (baud != 460800) abort();
  }
  template <typename... T> void printf(const char *format, T... values) { std::printf(format, values...); }
};

inline SerialPort Serial;
