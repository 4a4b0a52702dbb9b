//! A logger's file, made up.

use motec_i2::{ChannelMetadata, Datatype, Header, LDWriter, Sample};
use std::io::Cursor;

/// Where the first channel's entry stands.
pub const ENTRY: usize = 0x3448;

/// A channel of samples at a rate (Hz), as they are.
pub fn channel(name: &str, unit: &str, datatype: Datatype, sample_rate: u16) -> ChannelMetadata {
    ChannelMetadata {
        prev_addr: 0,
        next_addr: 0,
        data_addr: 0,
        data_count: 0,
        datatype,
        sample_rate,
        offset: 0,
        mul: 1,
        scale: 1,
        dec_places: 0,
        name: name.to_owned(),
        short_name: String::new(),
        unit: unit.to_owned(),
    }
}

/// The bytes of a file with these channels.
pub fn file(channels: Vec<(ChannelMetadata, Vec<Sample>)>) -> Vec<u8> {
    let header = Header {
        channel_meta_ptr: ENTRY as u32,
        channel_data_ptr: 0,
        event_ptr: 0,
        device_serial: 1,
        device_type: "ADL".to_owned(),
        device_version: 420,
        num_channels: channels.len() as u32,
        date_string: "01/02/2020".to_owned(),
        time_string: "10:00:00".to_owned(),
        driver: String::new(),
        vehicleid: "GT".to_owned(),
        venue: "Test".to_owned(),
        session: String::new(),
        short_comment: String::new(),
    };
    let mut cursor = Cursor::new(Vec::new());
    let mut writer = LDWriter::new(&mut cursor, header);
    for (metadata, samples) in channels {
        writer = writer.with_channel(metadata, samples);
    }
    writer.write().expect("a file in memory");
    cursor.into_inner()
}
