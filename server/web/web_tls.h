// The page's side of TLS.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>

#include "server/web/tls_certificates.h"

namespace helio {

// For browsers' connections, by the certificates in force. Called by one thread.
class WebTls {
 public:
  explicit WebTls(std::shared_ptr<TlsCertificates> certificates) : certificates_(std::move(certificates)) {}

  // For the next connection. Null: the page is served without TLS.
  std::shared_ptr<boost::asio::ssl::context> context();

 private:
  const std::shared_ptr<TlsCertificates> certificates_;  // null: none
  std::uint64_t version_ = 0;                            // of context_
  std::shared_ptr<boost::asio::ssl::context> context_;
};

}  // namespace helio
