// Places the relays of triggered publishers: once all bodies are there, on the body of the program whose
// values they wait for. One whose topic no program of the world has waits to be told, by a client or another
// relay.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "worlds/gazebo/publication.h"
#include "worlds/loader/notices.h"

namespace tessera {

class Relays {
 public:
  // A program of a body of the world has its values on a topic, or is told on one.
  void note_says(const std::string& topic, std::size_t body, std::size_t program) {
    says_.push_back({topic, body, program});
  }
  void note_hears(const std::string& topic, std::size_t body, std::size_t program) {
    hears_.push_back({topic, body, program});
  }
  void add(const gazebo::Publication& publication) { waiting_.push_back(publication); }

  void place(WorldDescription& world, Notices& notices);

 private:
  // A program that has a topic.
  struct Place {
    std::string topic;
    std::size_t body = 0;
    std::size_t program = 0;
  };

  // False while nobody hears it.
  bool place(const gazebo::Publication& publication, WorldDescription& world, Notices& notices);

  std::vector<Place> says_;
  std::vector<Place> hears_;
  std::vector<gazebo::Publication> waiting_;
};

}  // namespace tessera
