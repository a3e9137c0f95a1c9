// Weighted-fair queue over clients (render loops) that share the workers: hierarchical start-time fair queueing (Goyal,
// Guo, Vin 1996; Goyal, Vin, Cheng 1996) over the time that each has used. Groups with something to run share in
// proportion to their weights, the clients of a group evenly.
//
// A plain data structure: its owner locks it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace helio {

class FairQueue {
 public:
  using Id = std::uint64_t;

  // weights: of the groups, > 0.
  explicit FairQueue(const std::vector<double>& weights);

  Id add(std::size_t group);
  void remove(Id id);  // precondition: nothing of it is in flight

  // Says if the client has something to run. One that was idle starts level with those that were not, and so does a
  // group of which all were: idling saves up no credit.
  void set_ready(Id id, bool ready);
  bool any_ready() const;  // of those that may have a turn

  // Nobody else has a turn from now on; nothing: everyone has, again. A client that is removed holds no longer.
  void hold(std::optional<Id> id) { holder_ = id; }
  std::optional<Id> holder() const { return holder_; }

  // The client whose turn it is, charged in advance with what its pieces usually take.
  std::optional<Id> take();
  void finish(Id id, double seconds);

  int in_flight(Id id) const { return clients_.at(id).in_flight; }
  double used_seconds(Id id) const { return clients_.at(id).used_seconds; }
  double used_seconds() const { return used_seconds_; }  // of all clients that there ever were

 private:
  struct Group {
    double weight = 1;
    int ready = 0, in_flight = 0;  // clients | pieces
    double virtual_time = 0;       // seconds over weight
    double client_time = 0;        // virtual time at which the group's last piece was handed out
  };
  struct Client {
    Group* group = nullptr;
    bool ready = false;
    int in_flight = 0;
    double virtual_time = 0;  // seconds
    double used_seconds = 0;
    double piece_seconds = 1e-3;  // running mean of what a piece takes
    double charged_ahead = 0;     // seconds charged for pieces in flight
  };
  static void charge(Client& client, double seconds);
  bool may_run(Id id) const { return !holder_ || *holder_ == id; }

  std::vector<Group> groups_;
  std::map<Id, Client> clients_;
  std::optional<Id> holder_;
  double used_seconds_ = 0;
  double group_time_ = 0;  // virtual time of the group of which the last piece was handed out
  Id next_id_ = 1;
};

}  // namespace helio
