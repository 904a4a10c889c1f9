//! A text that is served by HTTP at one address.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time that a client has for its whole request: one that sends it byte by byte, or says nothing, is not waited for longer.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(2);

/// Maximum number of clients at a time, each of which has a thread. For those beyond it the oldest is disconnected.
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
        let mut clients: VecDeque<(TcpStream, JoinHandle<()>)> = VecDeque::new();
        for stream in listener.incoming().flatten() {
            clients.retain(|(_, client)| !client.is_finished());
            if clients.len() >= MAX_CLIENTS
                && let Some((oldest, _)) = clients.pop_front()
            {
                // Who asks is answered at once, so it has only kept others waiting. Its thread ends by itself.
                let _ = oldest.shutdown(Shutdown::Both);
            }
            let Ok(handle) = stream.try_clone() else { continue };
            let text = text.clone();
            let client = std::thread::spawn(move || {
                // A malformed request gets no answer.
                let _ = respond(&stream, &text);
                // Its other handle may live on for a while.
                let _ = stream.shutdown(Shutdown::Both);
            });
            clients.push_back((handle, client));
        }
    });
    Ok(())
}

fn respond(mut stream: &TcpStream, text: &Mutex<String>) -> io::Result<()> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hundreds_of_clients_that_say_nothing_keep_nobody_waiting() {
        let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("bound");
        let text = Arc::new(Mutex::new("frames 7\n".to_string()));
        serve_http_text(&free.to_string(), text).expect("served");
        let silent: Vec<_> = (0..400).map(|_| TcpStream::connect(free).expect("open")).collect();
        let mut client = TcpStream::connect(free).expect("open");
        client.write_all(b"GET /metrics HTTP/1.1\r\n\r\n").expect("sent");
        // One after the other, they would take many minutes.
        client.set_read_timeout(Some(Duration::from_secs(60))).expect("a time");
        let mut answer = String::new();
        client.read_to_string(&mut answer).expect("the connection is ended");
        assert!(answer.ends_with("frames 7\n"), "{answer}");
        drop(silent);
    }
}
