//! Frames as their makers' documents lay them out, written apart from the readers.

/// Bytes of hexadecimal digits.
pub(super) fn hex(text: &str) -> Vec<u8> {
    let pairs = text.as_bytes().chunks(2);
    pairs
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

/// Numbers in a form of Xsens'.
pub(super) fn numbers(form: u16, values: &[f64]) -> Vec<u8> {
    let each = values.iter().map(|v| match form {
        0 => (*v as f32).to_be_bytes().to_vec(),
        1 => ((v * f64::from(1 << 20)) as i32).to_be_bytes().to_vec(),
        2 => {
            let fixed = ((v * 4_294_967_296.0) as i64).to_be_bytes();
            [&fixed[4..], &fixed[2..4]].concat()
        }
        _ => v.to_be_bytes().to_vec(),
    });
    each.collect::<Vec<_>>().concat()
}

/// Packet of an MTi with a counter and a time.
pub(super) fn xsens(items: &[(u16, Vec<u8>)], counter: Option<u16>, fine: Option<u32>) -> Vec<u8> {
    let mut data = Vec::new();
    let mut item = |id: u16, bytes: &[u8]| {
        data.extend(id.to_be_bytes());
        data.push(bytes.len() as u8);
        data.extend_from_slice(bytes);
    };
    if let Some(counter) = counter {
        item(0x1020, &counter.to_be_bytes());
    }
    if let Some(fine) = fine {
        item(0x1060, &fine.to_be_bytes());
    }
    items.iter().for_each(|(id, bytes)| item(*id, bytes));
    let mut packet = [&[0xfa, 0xff, 0x36, data.len() as u8], data.as_slice()].concat();
    let sum: u8 = packet[1..].iter().fold(0, |sum, b| sum.wrapping_add(*b));
    packet.push(0u8.wrapping_sub(sum));
    packet
}

/// Message of an x-IMU3 in binary.
pub(super) fn ximu3(letter: u8, time: u64, numbers: &[f32]) -> Vec<u8> {
    let mut body = vec![letter + 0x80];
    body.extend(time.to_le_bytes());
    body.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
    let stuffed = body.iter().flat_map(|byte| match byte {
        0x0a => vec![0xdb, 0xdc],
        0xdb => vec![0xdb, 0xdd],
        byte => vec![*byte],
    });
    stuffed.chain([0x0a]).collect()
}

/// Frame of WitMotion's.
pub(super) fn witmotion(kind: u8, numbers: [i32; 4]) -> Vec<u8> {
    let mut frame = vec![0x55, kind];
    frame.extend(numbers.iter().flat_map(|n| (*n as u16).to_le_bytes()));
    let sum = frame.iter().fold(0, |sum: u8, b| sum.wrapping_add(*b));
    frame.push(sum);
    frame
}

/// Message of a VectorNav: groups from 0, bits of fields, bytes of all fields.
pub(super) fn vectornav(groups: &[(u8, u16, Vec<u8>)]) -> Vec<u8> {
    let bits = groups
        .iter()
        .fold(0, |bits, (group, ..)| bits | 1u8 << group);
    let mut message = vec![bits];
    groups
        .iter()
        .for_each(|(_, fields, _)| message.extend(fields.to_le_bytes()));
    groups.iter().for_each(|(.., bytes)| message.extend(bytes));
    // Bit by bit: polynomial 0x1021, from 0.
    let crc = message.iter().fold(0u16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| match crc & 0x8000 {
            0 => crc << 1,
            _ => crc << 1 ^ 0x1021,
        })
    });
    [&[0xfa], message.as_slice(), &crc.to_be_bytes()].concat()
}

/// Packet of MIP.
pub(super) fn mip(set: u8, fields: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut data = Vec::new();
    for (descriptor, bytes) in fields {
        data.extend([bytes.len() as u8 + 2, *descriptor]);
        data.extend(bytes);
    }
    let mut packet = [&[0x75, 0x65, set, data.len() as u8], data.as_slice()].concat();
    let (mut one, mut two) = (0u16, 0u16);
    for byte in &packet {
        one = (one + u16::from(*byte)) % 256;
        two = (two + one) % 256;
    }
    packet.extend([one as u8, two as u8]);
    packet
}

/// Bytes of `count` samples, 10 ms apart.
pub(super) fn stream(name: &str, count: u32) -> Vec<u8> {
    (0..count).flat_map(|n| sample(name, n)).collect()
}

fn sample(name: &str, n: u32) -> Vec<u8> {
    let rate = [0.01 * f64::from(n), -0.5, 0.25];
    let singles = rate.map(|v| v as f32);
    let le = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let be = |v: &[f32]| v.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    match name {
        "xsens" => {
            let items = [
                (0x8020, numbers(0, &rate)),
                (0x4020, numbers(0, &[0.0, 0.0, 9.81])),
                (0xc020, numbers(0, &[1.0, 0.5, 0.25])),
            ];
            xsens(&items, Some(n as u16), Some(100 * n))
        }
        "ximu3" => {
            let [x, y, z] = singles;
            ximu3(b'I', 10_000 * u64::from(n), &[x, y, z, 0.0, 0.0, 1.0])
        }
        "witmotion" => {
            let (second, milli) = (n / 100, 10 * (n % 100));
            let time = [24 | 5 << 8, 17 | 8 << 8, second as i32 * 256, milli as i32];
            let cycle = [
                (0x50, time),
                (0x51, [0, 0, 2048, 0]),
                (0x52, [n as i32, -20, 30, 0]),
            ];
            cycle
                .into_iter()
                .flat_map(|(kind, v)| witmotion(kind, v))
                .collect()
        }
        "vectornav" => {
            let time = (10_000_000 * u64::from(n)).to_le_bytes().to_vec();
            let common = [time, le(&singles), le(&[0.0, 0.0, -9.81])].concat();
            vectornav(&[(0, 1 | 1 << 5 | 1 << 8, common)])
        }
        "mip" => {
            let time = (10_000_000 * u64::from(n)).to_be_bytes().to_vec();
            mip(
                0x80,
                &[
                    (0x04, be(&[0.0, 0.0, -1.0])),
                    (0x05, be(&singles)),
                    (0xd5, time),
                ],
            )
        }
        _ => {
            let mut frame = vec![n as u8, 1, 0, 2, 0, 3, 0, 0, 0, 0, 0, 232, 3, 0, 0, 0];
            frame.push(frame.iter().fold(0, |sum: u8, b| sum.wrapping_add(*b)));
            [&[0xaa, 0xaa], frame.as_slice()].concat()
        }
    }
}
