// The bus, and the sensor on it.
#pragma once
#include "Arduino.h"

struct TwoWire {
  uint8_t registers[256] = {}, pointer = 0;
  bool names_register = false;
  int polls = 0, samples = 0, left = 0;
  uint8_t answer[16] = {};

  TwoWire() { registers[0x6B] = 0x40; }
  void begin() {}
  void setClock(uint32_t hertz) {
    if (hertz != 400000) abort();
  }
  void beginTransmission(uint8_t address) {
    if (address != 0x68) abort();
    names_register = true;
  }
  void write(uint8_t value) {
    if (names_register) pointer = value;
    else registers[pointer++] = value;
    names_register = false;
  }
  uint8_t endTransmission(bool = true) { return 0; }
  uint8_t requestFrom(uint8_t, uint8_t count) {
    left = count;
    if (pointer == 0x3A) {
      // 200 a second, if it was asked for that; asked five times for each.
      if (registers[0x6B] & 0x40 || registers[0x1A] == 0 || registers[0x19] != 4) abort();
      clock_us() += 960;
      answer[0] = polls++ % 5 == 4;
    } else if (pointer == 0x3B && count == 14) {
      int range = 250 << (registers[0x1B] >> 3), force = 2 << (registers[0x1C] >> 3);
      int16_t values[7] = {0, 0, int16_t(32768 / force), 0, 0, 0, int16_t(90.0 / range * 32768 + 0.5)};
      for (int i = 0; i < 7; i++) answer[2 * i] = uint16_t(values[i]) >> 8, answer[2 * i + 1] = uint8_t(values[i]);
      if (++samples > 201) std::exit(0);
    } else {
      abort();
    }
    return count;
  }
  uint8_t read() {
    static int at = 0;
    uint8_t value = answer[at++];
    if (--left == 0) at = 0;
    return value;
  }
};

inline TwoWire Wire;
