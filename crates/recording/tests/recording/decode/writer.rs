//! Bytes made by hand: CDR, ROS 1, protobuf. Written from the specifications, not from the decoder.

/// A CDR (or packed) writer.
#[derive(Clone)]
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    big: bool,
    /// Origin of alignment; `None`: nothing is aligned (ROS 1).
    origin: Option<usize>,
}

impl Writer {
    pub(crate) fn cdr(big: bool) -> Self {
        Writer {
            bytes: vec![0, u8::from(!big), 0, 0],
            big,
            origin: Some(4),
        }
    }

    pub(crate) fn ros1() -> Self {
        Writer {
            bytes: Vec::new(),
            big: false,
            origin: None,
        }
    }

    fn put(mut self, mut little: Vec<u8>) -> Self {
        if let Some(origin) = self.origin {
            while !(self.bytes.len() - origin).is_multiple_of(little.len()) {
                // Padding is whatever lay in memory: a decoder must not look at it.
                self.bytes.push(0xa5);
            }
        }
        if self.big {
            little.reverse();
        }
        self.bytes.append(&mut little);
        self
    }

    pub(crate) fn u8(self, v: u8) -> Self {
        self.put(vec![v])
    }

    pub(crate) fn i16(self, v: i16) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn i32(self, v: i32) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn u32(self, v: u32) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn u64(self, v: u64) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn f32(self, v: f32) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn f64(self, v: f64) -> Self {
        self.put(v.to_le_bytes().to_vec())
    }

    pub(crate) fn f32s(self, values: &[f32]) -> Self {
        values.iter().fold(self, |w, v| w.f32(*v))
    }

    pub(crate) fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |w, v| w.f64(*v))
    }

    /// CDR counts and writes a terminator, ROS 1 has none.
    pub(crate) fn string(mut self, text: &str) -> Self {
        let nul = usize::from(self.origin.is_some());
        self = self.u32((text.len() + nul) as u32);
        self.bytes.extend(text.as_bytes());
        self.bytes.extend(std::iter::repeat_n(0, nul));
        self
    }

    pub(crate) fn header(self, sec: i32, nanosec: u32, frame: &str) -> Self {
        let seq = self.origin.is_none();
        let w = if seq { self.u32(7) } else { self };
        w.i32(sec).u32(nanosec).string(frame)
    }

    /// The body of an Imu: each number tells where it stood.
    pub(crate) fn imu_body(self, gyro_mark: f64, orientation_mark: f64) -> Self {
        let mut covariance = [0.25; 9];
        covariance[0] = orientation_mark;
        let w = self.f64s(&[0.1, 0.2, 0.3, 0.9]).f64s(&covariance);
        covariance[0] = gyro_mark;
        w.f64s(&GYRO).f64s(&covariance).f64s(&ACCEL).f64s(&[0.5; 9])
    }

    pub(crate) fn imu(self, frame: &str) -> Self {
        self.header(1_700_000_000, 5, frame).imu_body(0.0, 0.0)
    }
}

pub(crate) const GYRO: [f64; 3] = [1.5, -2.5, 3.25];
pub(crate) const ACCEL: [f64; 3] = [0.125, -0.25, 9.75];
/// w, x, y, z of [`Writer::imu_body`].
pub(crate) const ORIENTATION: [f64; 4] = [0.9, 0.1, 0.2, 0.3];
pub(crate) const STAMP: i64 = 1_700_000_000_000_000_005;

pub(crate) const IMU: &str = "\
# a comment with a # in it
std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// A section of concatenated message text.
pub(crate) fn section(name: &str, fields: &str) -> String {
    format!("\n{}\nMSG: {name}\n{fields}\n", "=".repeat(80))
}

/// [`IMU`] as a section, with everything it needs.
pub(crate) fn imu_section() -> String {
    section("sensor_msgs/Imu", IMU)
}

/// A protobuf writer.
#[derive(Default, Clone)]
pub(crate) struct Proto(pub(crate) Vec<u8>);

impl Proto {
    fn varint_bytes(mut v: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        loop {
            let low = (v & 0x7f) as u8;
            v >>= 7;
            if v == 0 {
                bytes.push(low);
                return bytes;
            }
            bytes.push(low | 0x80);
        }
    }

    fn key(mut self, number: u32, wire: u8) -> Self {
        self.0
            .extend(Self::varint_bytes(u64::from(number) << 3 | u64::from(wire)));
        self
    }

    pub(crate) fn varint(self, number: u32, v: u64) -> Self {
        let mut w = self.key(number, 0);
        w.0.extend(Self::varint_bytes(v));
        w
    }

    pub(crate) fn double(self, number: u32, v: f64) -> Self {
        let mut w = self.key(number, 1);
        w.0.extend(v.to_le_bytes());
        w
    }

    pub(crate) fn float(self, number: u32, v: f32) -> Self {
        let mut w = self.key(number, 5);
        w.0.extend(v.to_le_bytes());
        w
    }

    pub(crate) fn bytes(self, number: u32, bytes: &[u8]) -> Self {
        let mut w = self.key(number, 2);
        w.0.extend(Self::varint_bytes(bytes.len() as u64));
        w.0.extend(bytes);
        w
    }

    pub(crate) fn message(self, number: u32, inner: Proto) -> Self {
        self.bytes(number, &inner.0)
    }

    /// A `FieldDescriptorProto`: type 1 double, 2 float, 3 int64, 4 uint64, 9 string, 11 message.
    pub(crate) fn field(
        name: &str,
        number: u32,
        repeated: bool,
        kind: u64,
        type_name: &str,
    ) -> Proto {
        let field = Proto::default()
            .bytes(1, name.as_bytes())
            .varint(3, u64::from(number))
            .varint(4, if repeated { 3 } else { 1 })
            .varint(5, kind);
        if type_name.is_empty() {
            field
        } else {
            field.bytes(6, type_name.as_bytes())
        }
    }

    /// A `DescriptorProto`.
    pub(crate) fn message_type(name: &str, fields: Vec<Proto>) -> Proto {
        let head = Proto::default().bytes(1, name.as_bytes());
        fields.into_iter().fold(head, |w, f| w.message(2, f))
    }

    /// A `FileDescriptorSet` of one file.
    pub(crate) fn file_set(package: &str, messages: Vec<Proto>) -> Vec<u8> {
        let file = Proto::default()
            .bytes(1, b"a.proto")
            .bytes(2, package.as_bytes());
        let file = messages.into_iter().fold(file, |w, m| w.message(4, m));
        Proto::default().message(1, file.bytes(12, b"proto3")).0
    }
}
