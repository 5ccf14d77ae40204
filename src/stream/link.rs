//! What a session talks through: a serial port, a network address, or the simulated controller. Each has its clock.

#[cfg(feature = "serial")]
mod serial;

#[cfg(feature = "serial")]
pub use serial::{PortInfo, Serial, ports};

use crate::controller::{Controller, Store};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// How long a network address may take to answer, s.
const CONNECT_S: u64 = 5;

/// Most bytes taken at once.
const READ_BYTES: usize = 1024;

/// Steps in which a simulation lets time pass while something is awaited, s.
const LOOK_S: f64 = 0.001;

/// Why a port cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// It cannot be opened.
    #[error("cannot open {port}: {why}; {cure}")]
    Open {
        /// Its name.
        port: String,
        /// What the system says.
        why: String,
        /// What to do.
        cure: &'static str,
    },
    /// It was open and is gone.
    #[error("the port is gone ({why}); check cable and supply")]
    Lost {
        /// What the system says.
        why: String,
    },
}

/// What happens to the DTR line when a serial port is opened: boards with an Arduino start afresh when it falls and
/// rises, and lose their position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dtr {
    /// As the system does it.
    Keep,
    /// On.
    On,
    /// Off.
    Off,
}

/// Bytes to and from a controller, and the time.
pub trait Link: Send {
    /// Adds what came to `into`; waits for it, at most so long, s.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError>;

    /// Sends bytes.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// The time, s from some moment on.
    fn now_s(&self) -> f64;
}

fn lost(why: impl std::fmt::Display) -> LinkError {
    LinkError::Lost { why: why.to_string() }
}

/// What a read gave: bytes, nothing in time, or the end.
fn taken(read: std::io::Result<usize>) -> Result<usize, LinkError> {
    match read {
        Ok(0) => Err(lost("the other end has closed it")),
        Ok(n) => Ok(n),
        Err(e)
            if matches!(
                e.kind(),
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
            ) =>
        {
            Ok(0)
        }
        Err(e) => Err(lost(e)),
    }
}

/// A controller on the network: a serial port behind a TCP server, or one with a network of its own.
#[derive(Debug)]
pub struct Tcp {
    stream: TcpStream,
    begun: Instant,
}

impl Tcp {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// [`LinkError::Open`].
    pub fn open(address: &str) -> Result<Self, LinkError> {
        let cure = "check that the controller is on, in the same network, and that the address is HOST:PORT";
        let fault = |why: String| LinkError::Open { port: format!("tcp://{address}"), why, cure };
        let mut why = String::from("the name has no address");
        for socket in address.to_socket_addrs().map_err(|e| fault(e.to_string()))? {
            match TcpStream::connect_timeout(&socket, Duration::from_secs(CONNECT_S)) {
                Ok(stream) => {
                    let _ = stream.set_nodelay(true);
                    let wait = Some(Duration::from_secs(CONNECT_S));
                    stream.set_write_timeout(wait).map_err(|e| fault(e.to_string()))?;
                    return Ok(Self { stream, begun: Instant::now() });
                }
                Err(e) => why = e.to_string(),
            }
        }
        Err(fault(why))
    }
}

impl Link for Tcp {
    fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError> {
        let wait = Duration::from_secs_f64(wait_s.max(LOOK_S));
        self.stream.set_read_timeout(Some(wait)).map_err(lost)?;
        let mut bytes = [0; READ_BYTES];
        let n = taken(self.stream.read(&mut bytes))?;
        into.extend_from_slice(&bytes[..n]);
        Ok(())
    }

    fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.stream.write_all(bytes).map_err(lost)
    }

    fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}

/// The simulated controller.
#[derive(Debug)]
pub struct Simulation {
    controller: Controller,
    /// `None`: its time passes as fast as it can be computed.
    begun: Option<Instant>,
}

impl Simulation {
    /// In real time.
    pub fn new(store: Store) -> Self {
        Self { controller: Controller::new(store), begun: Some(Instant::now()) }
    }

    /// As fast as it can be computed.
    pub fn fast(store: Store) -> Self {
        Self { controller: Controller::new(store), begun: None }
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The controller, to do things to.
    pub fn controller_mut(&mut self) -> &mut Controller {
        &mut self.controller
    }
}

impl Link for Simulation {
    fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError> {
        let until_s = self.now_s() + wait_s;
        loop {
            let said = self.controller.take_output();
            into.extend_from_slice(&said);
            let now_s = self.now_s();
            if self.controller.is_unplugged() {
                return Err(lost("the simulated cable is out"));
            }
            if !said.is_empty() || now_s >= until_s {
                return Ok(());
            }
            let look_s = LOOK_S.min(until_s - now_s);
            match self.begun {
                None => self.controller.advance(look_s),
                Some(begun) => {
                    std::thread::sleep(Duration::from_secs_f64(look_s));
                    let behind_s = begun.elapsed().as_secs_f64() - self.controller.now_s();
                    self.controller.advance(behind_s.max(0.0));
                }
            }
        }
    }

    fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.controller.feed(bytes);
        Ok(())
    }

    fn now_s(&self) -> f64 {
        self.controller.now_s()
    }
}
