// gRPC's side of TLS.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/web/tls_certificates.h"

namespace helio {

// For ServerBuilder::AddListeningPort: each connection gets the newest certificate. To be kept until the server that it
// was given to is gone.
std::shared_ptr<grpc::ServerCredentials> make_tls_credentials(std::shared_ptr<TlsCertificates> certificates);

}  // namespace helio
