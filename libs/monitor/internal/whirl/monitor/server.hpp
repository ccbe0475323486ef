#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "whirl/monitor/hub.hpp"

namespace whirl::monitor {

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< loopback unless the user says otherwise
  std::uint16_t port = 8765;          ///< 0: any free port
  std::string token;                  ///< needed for every command; empty: no commands at all
  std::size_t max_clients = 16;       ///< viewers; those with the token have places of their own
  double idle = 60;                   ///< s without a sign of somebody who looks; then a new viewer may take the place
  std::size_t queue = 64;             ///< messages that wait for one client before the oldest is dropped
  std::uint64_t largest_file = 256 << 20;  ///< bytes of a recording that the page may send
};

/// Serves the page and the stream from one thread. The hub must outlive the server.
///
/// GET / and the files of the page, WebSocket at /stream, POST /open/played or /open/compared with a recording as its
/// body, the token in X-Whirl-Token and the name of the file, percent-encoded, in X-Whirl-Name: one at a time, read in
/// a thread of its own (Hub::open). A request whose Host is not this server's address, or whose
/// Origin is another page, is refused (DNS rebinding, foreign pages). Clients read; a client that sends {"command":
/// ..., "token": ...} with the right token controls. A client that opens /stream?token=... with it has a place
/// that no viewer can take; with a wrong one it is a viewer. A page in front of somebody says {"here": true} from time
/// to time; when all places are taken, the viewer that has been silent longest makes room. Refused commands are told
/// once a minute with their number. Slow or silent clients lose frames or their connection, never the hub's time.
class Server {
 public:
  /// Binds at once; throws Error when the address cannot be used.
  Server(Hub& hub, const ServerOptions& options);
  ~Server();
  void start();
  void stop();
  std::uint16_t port() const;
  /// Address of the page with the token behind '#', which browsers do not send to servers.
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// 128 random bits as hex, from the system's generator.
std::string make_token();

}  // namespace whirl::monitor
