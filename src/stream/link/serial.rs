//! Serial ports, and the list of them.

use super::{Dtr, Link, LinkError, READ_BYTES, lost, taken};
use serialport::{SerialPort, SerialPortType};
use std::time::{Duration, Instant};

/// A port in the list.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct PortInfo {
    /// What to open: `/dev/ttyUSB0`, `COM3`.
    pub name: String,
    /// What the device says it is, as far as it does: maker, product, numbers.
    pub device: String,
    /// True for a USB device: most controllers are.
    pub usb: bool,
}

/// The serial ports that the system knows, USB devices first.
///
/// # Errors
/// [`LinkError::Open`] when the system does not tell.
pub fn ports() -> Result<Vec<PortInfo>, LinkError> {
    let found = serialport::available_ports().map_err(|e| LinkError::Open {
        port: "the list of ports".into(),
        why: e.to_string(),
        cure: "name the port with --port",
    })?;
    let mut ports: Vec<PortInfo> = found
        .into_iter()
        .map(|port| {
            let (device, usb) = match port.port_type {
                SerialPortType::UsbPort(usb) => {
                    let names = [usb.manufacturer, usb.product];
                    let mut words: Vec<String> = names.into_iter().flatten().collect();
                    words.push(format!("{:04x}:{:04x}", usb.vid, usb.pid));
                    words.extend(usb.serial_number);
                    (words.join(" "), true)
                }
                SerialPortType::PciPort => ("on the mainboard or a card".into(), false),
                SerialPortType::BluetoothPort => ("Bluetooth".into(), false),
                SerialPortType::Unknown => (String::new(), false),
            };
            PortInfo { name: port.port_name, device, usb }
        })
        .collect();
    ports.sort_by(|a, b| (!a.usb, &a.name).cmp(&(!b.usb, &b.name)));
    Ok(ports)
}

/// An open serial port.
pub struct Serial {
    port: Box<dyn SerialPort>,
    begun: Instant,
}

impl std::fmt::Debug for Serial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Serial").field("port", &self.port.name()).finish_non_exhaustive()
    }
}

impl Serial {
    /// Opens a port for us alone, 8 bits, no parity, 1 stop bit, no flow control.
    ///
    /// # Errors
    /// [`LinkError::Open`].
    pub fn open(name: &str, baud: u32, dtr: Dtr) -> Result<Self, LinkError> {
        let builder = serialport::new(name, baud);
        let builder = match dtr {
            Dtr::Keep => builder,
            Dtr::On => builder.dtr_on_open(true),
            Dtr::Off => builder.dtr_on_open(false),
        };
        let port = builder.open().map_err(|e| {
            let why = e.to_string();
            let cure = match e.kind() {
                serialport::ErrorKind::Io(std::io::ErrorKind::PermissionDenied) => {
                    "ask for the right to use serial ports (on Linux: sudo usermod -aG dialout $USER, then log in again)"
                }
                _ if why.contains("busy") || why.contains("lock") => {
                    "another program has it open: close that one"
                }
                _ => "plug the machine in, and see which ports there are with: relievo ports",
            };
            LinkError::Open { port: name.to_string(), why, cure }
        })?;
        Ok(Self { port, begun: Instant::now() })
    }
}

impl Link for Serial {
    fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError> {
        // The system waits in whole milliseconds.
        let wait = Duration::from_millis((wait_s * 1e3).ceil().max(1.0) as u64);
        self.port.set_timeout(wait).map_err(lost)?;
        let mut bytes = [0; READ_BYTES];
        let n = taken(self.port.read(&mut bytes))?;
        into.extend_from_slice(&bytes[..n]);
        Ok(())
    }

    fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        // Room for a write that the driver delays; what is sent at once is at most a receive ring's worth.
        self.port.set_timeout(Duration::from_secs(1)).map_err(lost)?;
        self.port.write_all(bytes).map_err(lost)
    }

    fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}
