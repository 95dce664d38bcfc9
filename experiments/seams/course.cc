#include "experiments/seams/course.h"

#include <algorithm>
#include <cmath>

namespace tessera::seams {

double distance(const Samples& a, const Samples& b) {
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const double apart = (a[i].position - b[i].position).norm();
    if (!std::isfinite(apart)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, apart);
  }
  return largest;
}

double displacement(const Course& course) { return distance(course.start, course.end); }

double top(const Samples& samples) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples) highest = std::max(highest, sample.position.z());
  return highest;
}

bool all_asleep(const Samples& samples) {
  return std::all_of(samples.begin(), samples.end(), [](const Sample& sample) { return sample.asleep; });
}

}  // namespace tessera::seams
