//! A text that is served by HTTP at one address.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time that a client has for its whole request: one that sends it byte by byte, or says nothing, is not waited for longer.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(2);

/// Maximum number of clients at a time, each of which has a thread. Those beyond it wait until one has had its time.
const MAX_CLIENTS: usize = 64;

/// Maximum size of a request.
const MAX_REQUEST_BYTES: usize = 4096;

/// Serves a text at an address from now on, to several clients at a time. Each answer is the text at that moment.
///
/// # Errors
/// When the address cannot be bound.
pub fn serve_http_text(address: &str, text: Arc<Mutex<String>>) -> io::Result<()> {
    let listener = TcpListener::bind(address)?;
    std::thread::spawn(move || {
        let mut clients: Vec<JoinHandle<()>> = Vec::new();
        for stream in listener.incoming().flatten() {
            clients.retain(|client| !client.is_finished());
            if clients.len() >= MAX_CLIENTS {
                // The oldest has the least time left.
                let _ = clients.remove(0).join();
            }
            let text = text.clone();
            clients.push(std::thread::spawn(move || {
                // A malformed request gets no answer.
                let _ = respond(stream, &text);
            }));
        }
    });
    Ok(())
}

fn respond(mut stream: TcpStream, text: &Mutex<String>) -> io::Result<()> {
    let until = Instant::now() + REQUEST_TIMEOUT;
    stream.set_write_timeout(Some(REQUEST_TIMEOUT))?;
    let mut request = [0; MAX_REQUEST_BYTES];
    let mut length = 0;
    while !request[..length].windows(4).any(|end| end == b"\r\n\r\n") {
        let remaining = until.saturating_duration_since(Instant::now());
        if remaining.is_zero() {
            return Ok(());
        }
        stream.set_read_timeout(Some(remaining))?;
        let read = stream.read(&mut request[length..])?;
        // The client has closed the connection, or its request is too long.
        if read == 0 {
            return Ok(());
        }
        length += read;
    }
    let text = text.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let status = if request.starts_with(b"GET ") { "200 OK" } else { "405 Method Not Allowed" };
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n\
         Content-Length: {}\r\nConnection: close\r\n\r\n{text}",
        text.len()
    )
}
