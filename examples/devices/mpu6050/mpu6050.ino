// An MPU-6050 on an ESP32, or any Arduino with Wire: one JSON line a sample, 200 a second.
//
//   strapd serve 'serial:///dev/ttyUSB0?baud=460800&id=left'
//
// The line has the board's own time: the attitude does not suffer from what USB does to it. JSON needs no header, so that
// a daemon may begin to listen at any time.

#include <Wire.h>

const uint8_t ADDRESS = 0x68;
const float RAD_PER_COUNT = 0.017453293f / 16.4f;  // at 2000 deg/s
const float MPS2_PER_COUNT = 9.80665f / 4096.0f;   // at 8 g

void put(uint8_t reg, uint8_t value) {
  Wire.beginTransmission(ADDRESS);
  Wire.write(reg);
  Wire.write(value);
  Wire.endTransmission();
}

// `count` bytes from register `reg` on; false where the sensor does not answer.
bool get(uint8_t reg, uint8_t *to, uint8_t count) {
  Wire.beginTransmission(ADDRESS);
  Wire.write(reg);
  if (Wire.endTransmission(false) != 0) return false;
  if (Wire.requestFrom(ADDRESS, count) != count) return false;
  for (uint8_t i = 0; i < count; i++) to[i] = Wire.read();
  return true;
}

void setup() {
  Serial.begin(460800);
  Wire.begin();
  Wire.setClock(400000);
  put(0x6B, 0x01);  // awake, on the gyro's clock
  put(0x1A, 0x02);  // low-pass filter of 98 Hz: 1 kHz inside
  put(0x19, 4);     // every fifth: 200 Hz
  put(0x1B, 0x18);  // 2000 deg/s
  put(0x1C, 0x10);  // 8 g
}

void loop() {
  uint8_t ready, raw[14];
  if (!get(0x3A, &ready, 1) || !(ready & 1)) return;
  uint32_t now = micros();
  if (!get(0x3B, raw, sizeof raw)) return;
  float value[7];
  for (int i = 0; i < 7; i++) value[i] = (int16_t)(raw[2 * i] << 8 | raw[2 * i + 1]);
  Serial.printf("{\"stamp_us\":%lu,\"gyro\":[%.5f,%.5f,%.5f],\"accel\":[%.3f,%.3f,%.3f]}\n", (unsigned long)now,
                value[4] * RAD_PER_COUNT, value[5] * RAD_PER_COUNT, value[6] * RAD_PER_COUNT,
                value[0] * MPS2_PER_COUNT, value[1] * MPS2_PER_COUNT, value[2] * MPS2_PER_COUNT);
}
