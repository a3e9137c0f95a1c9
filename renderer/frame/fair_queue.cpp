#include "renderer/frame/fair_queue.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {

FairQueue::Id FairQueue::add(int rank, double weight) {
  Client client;
  client.rank = rank;
  client.weight = weight;
  client.virtual_time = rank_time_[rank];
  clients_.emplace(next_id_, client);
  return next_id_++;
}

void FairQueue::remove(Id id) {
  HELIO_DCHECK(clients_.at(id).in_flight == 0);
  clients_.erase(id);
}

void FairQueue::set_ready(Id id, bool ready) {
  Client& client = clients_.at(id);
  if (ready && !client.ready && client.in_flight == 0)
    client.virtual_time = std::max(client.virtual_time, rank_time_[client.rank]);
  client.ready = ready;
}

bool FairQueue::any_ready() const {
  return std::any_of(clients_.begin(), clients_.end(), [](const auto& item) { return item.second.ready; });
}

std::optional<FairQueue::Id> FairQueue::take() {
  auto best = clients_.end();
  for (auto it = clients_.begin(); it != clients_.end(); ++it) {
    const Client& c = it->second;
    if (!c.ready) continue;
    if (best == clients_.end() || c.rank < best->second.rank ||
        (c.rank == best->second.rank && c.virtual_time < best->second.virtual_time))
      best = it;
  }
  if (best == clients_.end()) return std::nullopt;
  Client& client = best->second;
  double& rank_time = rank_time_[client.rank];
  rank_time = std::max(rank_time, client.virtual_time);
  ++client.in_flight;
  client.charged_ahead += client.piece_seconds;
  client.virtual_time += client.piece_seconds / client.weight;
  return best->first;
}

void FairQueue::finish(Id id, double seconds) {
  Client& client = clients_.at(id);
  const double ahead = client.charged_ahead / client.in_flight;
  client.charged_ahead -= ahead;
  --client.in_flight;
  client.virtual_time += (seconds - ahead) / client.weight;
  client.used_seconds += seconds;
  client.piece_seconds += 0.1 * (seconds - client.piece_seconds);
}

}  // namespace helio
