#include "client/tls/diagnosis.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <memory>
#include <utility>
#include <vector>

namespace helio {
namespace {

constexpr int kPatienceMs = 3000;                  // for the connection, and for each answer
constexpr unsigned char kHttp2[] = {2, 'h', '2'};  // as gRPC's clients ask for it (RFC 7301)
constexpr std::size_t kMostNames = 5;              // of a certificate that are told

struct Free {
  void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
  void operator()(SSL* connection) const { SSL_free(connection); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(GENERAL_NAMES* names) const { GENERAL_NAMES_free(names); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

struct Socket {
  int value = -1;
  ~Socket() {
    if (value >= 0) close(value);
  }
};

// OpenSSL writes to a socket that may be closed, which would end the process.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoPipeSignal() {
    const timespec now{};
    if (!was_pending_) sigtimedwait(&pipe_, nullptr, &now);  // the one that came meanwhile
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  sigset_t pipe_, before_;
  bool was_pending_ = false;
};

struct Peer {
  std::string host, port;
};

Peer peer_of(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  Peer peer{address.substr(0, colon), colon == std::string::npos ? "" : address.substr(colon + 1)};
  if (peer.host.size() > 2 && peer.host.front() == '[') peer.host = peer.host.substr(1, peer.host.size() - 2);
  return peer;
}

bool is_literal_address(const std::string& host) {
  unsigned char bytes[sizeof(in6_addr)];
  return inet_pton(AF_INET, host.c_str(), bytes) == 1 || inet_pton(AF_INET6, host.c_str(), bytes) == 1;
}

// Within the patience; false: nobody takes it.
bool connect_to(const addrinfo& to, Socket& wire) {
  wire.value = socket(to.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (wire.value < 0) return false;
  if (connect(wire.value, to.ai_addr, to.ai_addrlen) != 0) {
    pollfd writable{wire.value, POLLOUT, 0};
    int error = 0;
    socklen_t size = sizeof error;
    if (poll(&writable, 1, kPatienceMs) != 1 || getsockopt(wire.value, SOL_SOCKET, SO_ERROR, &error, &size) != 0 ||
        error != 0)
      return false;
  }
  fcntl(wire.value, F_SETFL, fcntl(wire.value, F_GETFL) & ~O_NONBLOCK);
  const timeval patience{kPatienceMs / 1000, 0};
  setsockopt(wire.value, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(wire.value, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  return true;
}

bool connect_to(const Peer& peer, Socket& wire) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(peer.host.c_str(), peer.port.c_str(), &hints, &found) != 0) return false;
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> all(found, freeaddrinfo);
  for (const addrinfo* to = found; to; to = to->ai_next) {
    if (wire.value >= 0) close(std::exchange(wire.value, -1));
    if (connect_to(*to, wire)) return true;
  }
  return false;
}

// A handshake shows this, also one that failed.
struct Shown {
  bool asked = false;           // for a certificate of the caller
  Owned<X509> its_certificate;  // the daemon's
};

int note_that_it_asks(SSL*, void* shown) {
  static_cast<Shown*>(shown)->asked = true;
  return 1;
}

// OpenSSL keeps no certificate that it did not accept.
int note_its_certificate(int accepted, X509_STORE_CTX* store) {
  const auto* connection =
      static_cast<const SSL*>(X509_STORE_CTX_get_ex_data(store, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto& shown = *static_cast<Shown*>(SSL_get_app_data(connection));
  X509* certificate = X509_STORE_CTX_get0_cert(store);
  if (certificate && !shown.its_certificate && X509_up_ref(certificate) == 1) shown.its_certificate.reset(certificate);
  return accepted;
}

// The names that a certificate is for: "'render-7.example', '10.0.0.7'".
std::string names_of(X509* certificate) {
  const Owned<GENERAL_NAMES> names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  std::vector<std::string> told;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME& name = *sk_GENERAL_NAME_value(names.get(), i);
    if (name.type == GEN_DNS) {
      const auto* text = reinterpret_cast<const char*>(ASN1_STRING_get0_data(name.d.dNSName));
      told.emplace_back(text, std::size_t(ASN1_STRING_length(name.d.dNSName)));
    } else if (name.type == GEN_IPADD) {
      const int family = ASN1_STRING_length(name.d.iPAddress) == 4 ? AF_INET : AF_INET6;
      char text[INET6_ADDRSTRLEN];
      if (inet_ntop(family, ASN1_STRING_get0_data(name.d.iPAddress), text, sizeof text)) told.emplace_back(text);
    }
  }
  if (told.empty()) return "no name at all";
  std::string all;
  for (std::size_t i = 0; i < told.size() && i < kMostNames; ++i) all += (i > 0 ? ", '" : "'") + told[i] + "'";
  return told.size() > kMostNames ? all + ", ..." : all;
}

// Why the daemon's certificate was not accepted.
std::string explain(long problem, const Shown& shown, const Peer& peer, const TlsOptions& options) {
  switch (problem) {
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
      return "its certificate comes from no authority " +
             (options.ca_file.empty() ? std::string("that this machine trusts") : "in '" + options.ca_file + "'") +
             ": give the file with the right one (--tls-ca FILE)";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "its certificate, or that of the authority, has expired: it needs a new one";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "its certificate, or that of the authority, is not valid yet: is this machine's clock right?";
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return "its certificate is not for '" + (options.name.empty() ? peer.host : options.name) + "' but for " +
             (shown.its_certificate ? names_of(shown.its_certificate.get()) : "another name") +
             ": give the name that it has (--tls-name NAME)";
    default:
      return "its certificate is not accepted: " + std::string(X509_verify_cert_error_string(problem));
  }
}

Owned<SSL_CTX> make_context(const TlsOptions& options, Shown& shown) {
  Owned<SSL_CTX> context(SSL_CTX_new(TLS_client_method()));
  if (!context) return context;
  SSL_CTX_set_alpn_protos(context.get(), kHttp2, sizeof kHttp2);
  SSL_CTX_set_cert_cb(context.get(), note_that_it_asks, &shown);
  if (!options.on) return context;
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, note_its_certificate);
  if (options.ca_file.empty()) {
    SSL_CTX_set_default_verify_paths(context.get());
  } else {
    SSL_CTX_load_verify_file(context.get(), options.ca_file.c_str());
  }
  if (!options.certificate_file.empty()) {
    SSL_CTX_use_certificate_chain_file(context.get(), options.certificate_file.c_str());
    SSL_CTX_use_PrivateKey_file(context.get(), options.key_file.c_str(), SSL_FILETYPE_PEM);
  }
  return context;
}

void expect_name(SSL* connection, const std::string& name) {
  if (is_literal_address(name)) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(connection), name.c_str());
  } else {
    SSL_set_tlsext_host_name(connection, name.c_str());
    SSL_set1_host(connection, name.c_str());
  }
}

}  // namespace

std::string diagnose_tls(const std::string& address, const TlsOptions& options) {
  if (address.starts_with("unix:")) return {};
  const Peer peer = peer_of(address);
  Socket wire;
  if (!connect_to(peer, wire)) return {};
  const NoPipeSignal no_signal;
  Shown shown;
  const Owned<SSL_CTX> context = make_context(options, shown);
  const Owned<SSL> connection(context ? SSL_new(context.get()) : nullptr);
  if (!connection) return {};
  SSL_set_app_data(connection.get(), &shown);
  SSL_set_fd(connection.get(), wire.value);
  expect_name(connection.get(), options.name.empty() ? peer.host : options.name);
  ERR_clear_error();
  const bool shaken = SSL_connect(connection.get()) == 1;
  const unsigned long error = ERR_peek_error();
  const bool alert = ERR_GET_LIB(error) == ERR_LIB_SSL && ERR_GET_REASON(error) > SSL_AD_REASON_OFFSET;
  const long problem = SSL_get_verify_result(connection.get());
  ERR_clear_error();
  if (!options.on) {
    return shaken || shown.asked || alert ? "it speaks TLS: ask for it by --tls, and where its authority is not one of "
                                            "this machine's, by --tls-ca FILE"
                                          : "";
  }
  if (!shaken && problem != X509_V_OK) return explain(problem, shown, peer, options);
  // In TLS 1.3 a daemon that misses a certificate tells so after the handshake, or just hangs up.
  char byte;
  const bool answered = shaken && SSL_read(connection.get(), &byte, 1) == 1;
  ERR_clear_error();
  if (answered) return {};
  if (shown.asked && options.certificate_file.empty()) {
    return "it asks for a certificate of its callers: give one and its key (--tls-certificate FILE, --tls-key FILE)";
  }
  if (shown.asked) return "it does not accept the certificate in '" + options.certificate_file + "'";
  if (!shaken && error != 0 && !alert)
    return "it does not speak TLS: without it (no --tls, no --tls-ca) all that travels can be read";
  return {};
}

}  // namespace helio
