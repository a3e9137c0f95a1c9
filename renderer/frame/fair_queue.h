// Weighted-fair queue over clients (render loops) that share the workers: start-time fair queueing (Goyal, Vin, Cheng
// 1996) over the time that each has used, under strict ranks.
//
// A plain data structure: its owner locks it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace helio {

class FairQueue {
 public:
  using Id = std::uint64_t;

  // A lower rank goes first, always. Clients of one rank get time in proportion to weight, > 0.
  Id add(int rank, double weight = 1);
  void remove(Id id);  // precondition: nothing of it is in flight

  // Whether the client has something to run. One that was idle starts level with those that were not: idling saves up
  // no credit.
  void set_ready(Id id, bool ready);
  bool any_ready() const;

  // The client whose turn it is, charged in advance with what its pieces usually take.
  std::optional<Id> take();
  void finish(Id id, double seconds);

  int in_flight(Id id) const { return clients_.at(id).in_flight; }
  double used_seconds(Id id) const { return clients_.at(id).used_seconds; }

 private:
  struct Client {
    int rank = 0;
    double weight = 1;
    bool ready = false;
    int in_flight = 0;
    double virtual_time = 0;  // seconds over weight
    double used_seconds = 0;
    double piece_seconds = 1e-3;  // running mean of what a piece takes
    double charged_ahead = 0;     // seconds charged for pieces in flight
  };

  std::map<Id, Client> clients_;
  std::map<int, double> rank_time_;  // virtual time at which the rank's last piece was handed out
  Id next_id_ = 1;
};

}  // namespace helio
