// gRPC's credentials of a channel.
#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>

#include "client/tls/tls_options.h"
#include "renderer/base/result.h"

namespace helio {

// Finds what is wrong with the options, by field ("ca_file", ...): a file that cannot be read, is not PEM, wants a
// passphrase, a key that is another certificate's, one of the two without the other. Empty: nothing, or TLS is off.
Problems find_tls_problems(const TlsOptions& options);

// Errors: invalid_argument, all problems together, each with "tls." before its field.
Result<std::shared_ptr<grpc::ChannelCredentials>> make_channel_credentials(const TlsOptions& options);

}  // namespace helio
