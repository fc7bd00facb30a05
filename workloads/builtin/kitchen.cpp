#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "props.h"
#include "scenes.h"

namespace vrpipe {

// A kitchen: a model bulldozer on a laid table, chairs, counters and cupboards along two walls, a window over the sink.
void paint_kitchen(CapturePainter& painter) {
  painter.set_light({0.35, 0.8, -0.95}, {0.50, 0.47, 0.42}, {0.66, 0.65, 0.64});
  painter.set_contact_reach(0.35);
  painter.ring_of_cameras({0, 1.35, 0}, 1.45, 8);
  painter.ring_of_cameras({0, 1.8, 0}, 0.9, 4);
  Texture wall;
  wall.size = 1.5;
  wall.layers = 75;
  wall.gloss = 0.03;
  Texture thing;
  thing.layers = 62;
  thing.gloss = 0.10;
  Texture fine = thing;
  fine.size = 0.7;
  const Vec3 white = {0.90, 0.89, 0.86};

  // The table: round, of wood, a white cloth in its middle with a pattern, a board on it, the model.
  const Paint oak = [](const Vec3& p, double, double) {
    return mix({0.34, 0.19, 0.09}, {0.66, 0.44, 0.24}, fractal_noise({p[0] * 3, p[1] * 24, p[2] * 26}, 3));
  };
  painter.cylinder({0, 0.72, 0}, {0, 0.755, 0}, 0.78, 0.78, oak, thing);
  painter.cylinder({0, 0.06, 0}, {0, 0.72, 0}, 0.09, 0.07, oak, thing);
  painter.cylinder({0, 0, 0}, {0, 0.06, 0}, 0.34, 0.26, oak, thing);
  const Paint cloth = [=](const Vec3& p, double, double) {
    const double r = std::sqrt(p[0] * p[0] + p[2] * p[2]);
    if (r > 0.49) return Vec3{0.70, 0.66, 0.56};
    if (within(r, 0.43, 0.46) || within(r, 0.30, 0.315)) return Vec3{0.62, 0.16, 0.13};
    const double weave = fraction(p[0] * 45) < 0.5 ? 1.0 : 0.94;
    return white * (fraction(p[2] * 45) < 0.5 ? weave : weave * 0.95);
  };
  painter.surface(disc_surface({0, 0.757, 0}, {0, 1, 0}, 0, 0.5), cloth, fine);
  Texture model = fine;
  model.size = 0.5;
  model.depth = 0.001;
  bulldozer(painter, {0.02, 0.762, 0.02}, 0.30, model);

  // Places laid around: mats, plates, glasses; a bowl of fruit, a jug.
  for (int i = 0; i < 4; ++i) {
    constexpr double kPlaces[4][2] = {{-0.62, 0.02}, {0.02, -0.63}, {0.63, 0.03}, {-0.03, 0.63}};
    const Vec3 place = {kPlaces[i][0], 0.758, kPlaces[i][1]};
    painter.surface(
        disc_surface(place, {0, 1, 0}, 0, 0.135),
        [=](const Vec3& p, double, double) {
          const double r = glm::length(p - place);
          return within(r, 0.118, 0.126) ? Vec3{0.16, 0.28, 0.56} : (within(r, 0.085, 0.09) ? white * 0.75 : white);
        },
        fine);
    painter.surface(frustum_surface(place, place + Vec3{0, 0.014, 0}, 0.09, 0.135), plain(white), fine);
    const Vec3 glass = place * 0.9 + Vec3{0.17 * (i % 2 == 0 ? 0 : 1), 0.076, 0.17 * (i % 2 == 0 ? 1 : 0)};
    Texture clear = fine;
    clear.logit = -4;
    clear.layers = 16;
    clear.gloss = 0.3;
    painter.surface(frustum_surface(glass, glass + Vec3{0, 0.12, 0}, 0.028, 0.036), plain({0.82, 0.88, 0.90}), clear);
    painter.surface(disc_surface(glass + Vec3{0, 0.002, 0}, {0, 1, 0}, 0, 0.028), plain({0.6, 0.66, 0.68}), clear);
  }
  painter.cylinder({-0.36, 0.757, -0.42}, {-0.36, 0.81, -0.42}, 0.05, 0.10, plain({0.24, 0.44, 0.60}), fine);
  constexpr double kFruit[5][3] = {
      {-0.40, 0.825, -0.43}, {-0.33, 0.825, -0.40}, {-0.37, 0.83, -0.47}, {-0.35, 0.83, -0.36}, {-0.365, 0.87, -0.42}};
  for (int i = 0; i < 5; ++i) {
    painter.ball({kFruit[i][0], kFruit[i][1], kFruit[i][2]}, {0.036, 0.034, 0.036},
                 rough(i % 2 == 0 ? Vec3{0.62, 0.08, 0.06} : Vec3{0.45, 0.56, 0.10},
                       i % 2 == 0 ? Vec3{0.88, 0.30, 0.12} : Vec3{0.72, 0.74, 0.22}, 25),
                 fine);
  }
  // Chairs.
  constexpr double kChairs[3][3] = {{0.15, 1.12, 1}, {1.15, -0.05, 0}, {-0.75, 0.98, 1}};
  for (const auto& chair : kChairs) {
    const double x = chair[0], z = chair[1];
    const bool facing_z = chair[2] > 0;
    painter.box({x, 0.45, z}, {0.22, 0.02, 0.22}, oak, thing);
    for (const double dx : {-0.19, 0.19}) {
      for (const double dz : {-0.19, 0.19}) {
        const bool back = facing_z ? dz > 0 : dx > 0;
        painter.cylinder({x + dx, 0, z + dz}, {x + dx, back ? 1.0 : 0.44, z + dz}, 0.018, 0.02, oak, fine);
      }
    }
    for (int i = 0; i < 3; ++i) {
      const double y = 0.62 + 0.16 * i;
      painter.box(facing_z ? Vec3{x, y, z + 0.19} : Vec3{x + 0.19, y, z},
                  facing_z ? Vec3{0.19, 0.035, 0.012} : Vec3{0.012, 0.035, 0.19}, oak, fine);
    }
  }

  // The room: tiles, walls, ceiling, the window over the sink with a garden outside.
  const Paint tiles = [](const Vec3& p, double, double) {
    const bool joint = fraction(p[0] / 0.33) < 0.02 || fraction(p[2] / 0.33) < 0.02;
    const double shade = hash_fraction(std::floor(p[0] / 0.33) * 31 + std::floor(p[2] / 0.33), 2);
    return joint ? Vec3{0.42, 0.38, 0.33}
                 : mix({0.60, 0.50, 0.40}, {0.74, 0.63, 0.51}, 0.6 * shade + 0.4 * fractal_noise(p * 8.0, 2));
  };
  painter.quad({-2.6, 0, -2.6}, {0, 0, 5.2}, {5.4, 0, 0}, tiles, wall);
  painter.quad({-2.6, 2.5, -2.6}, {5.4, 0, 0}, {0, 0, 5.2}, plain({0.86, 0.85, 0.82}), wall);
  const auto window = [](double along, double y) {
    const double dx = std::fabs(along) / 0.72, dy = std::fabs(y - 1.58) / 0.46;
    const double d = std::max(dx, dy);
    if (d > 1) return 0;
    return d > 0.92 || dx < 0.03 ? 1 : 2;
  };
  const Paint back = [=](const Vec3& p, double, double) {
    const int part = window(p[0] + 0.15, p[1]);
    if (part == 1) return Vec3{1.0, 1.0, 0.98};
    if (part == 2) {
      const double hedge = 1.42 + 0.28 * fractal_noise({p[0] * 6, 1, 0}, 3);
      if (p[1] < hedge) return mix({0.28, 0.46, 0.18}, {0.72, 0.86, 0.48}, fractal_noise(p * 26.0, 3)) * 1.25;
      return mix({1.35, 1.36, 1.35}, {0.95, 1.15, 1.4}, 2 * (p[1] - 1.5));
    }
    if (within(p[1], 0.95, 1.42)) {  // tiles between counter and cupboards
      const bool joint = fraction(p[0] / 0.1) < 0.05 || fraction(p[1] / 0.1) < 0.05;
      const double pick = hash_fraction(std::floor(p[0] / 0.1) * 17 + std::floor(p[1] / 0.1), 8);
      return joint ? Vec3{0.70, 0.68, 0.64} : (pick > 0.86 ? Vec3{0.30, 0.44, 0.60} : Vec3{0.92, 0.90, 0.85});
    }
    return Vec3{0.86, 0.80, 0.66} * (0.96 + 0.06 * value_noise(p * 4.0));
  };
  Texture lit = wall;
  lit.emission = 0.25;
  lit.size = 1.2;
  painter.quad({2.8, 0, 2.6}, {-5.4, 0, 0}, {0, 2.5, 0}, back, lit);
  const Paint plaster = [](const Vec3& p, double, double) {
    return p[1] < 0.1 ? Vec3{0.92, 0.91, 0.88} : Vec3{0.86, 0.80, 0.66} * (0.96 + 0.06 * value_noise(p * 4.0));
  };
  painter.quad({2.8, 0, -2.6}, {0, 0, 5.2}, {0, 2.5, 0}, plaster, wall);
  // Behind the viewer, with shelves and pictures on them.
  const Paint shelves = [=](const Vec3& p, double u, double v) {
    const double along = std::fabs(p[2] + 2.6) < 0.01 ? p[0] : p[2];
    if (within(p[1], 0.4, 2.1) && within(along, -1.6, 1.4)) {
      if (fraction((p[1] - 0.4) / 0.34) < 0.08) return Vec3{0.44, 0.28, 0.16};
      const double thing_key = std::floor(along / 0.09) + 31 * std::floor((p[1] - 0.4) / 0.34);
      return Vec3{0.2 + 0.6 * hash_fraction(thing_key, 31), 0.2 + 0.5 * hash_fraction(thing_key, 32),
                  0.15 + 0.5 * hash_fraction(thing_key, 33)};
    }
    return plaster(p, u, v);
  };
  painter.quad({-2.6, 0, 2.6}, {0, 0, -5.2}, {0, 2.5, 0}, shelves, thing);
  painter.quad({-2.6, 0, -2.6}, {5.4, 0, 0}, {0, 2.5, 0}, shelves, thing);

  // Counters with doors and drawers, an oven, a worktop of stone, the sink and its tap.
  const auto front = [](double along, double y, double low, double high, double width, const Vec3& colour) {
    const double x = fraction(along / width), h = (y - low) / (high - low);
    if (!within(x, 0.015, 0.985)) return colour * 0.35;
    const bool panel = within(x, 0.14, 0.86) && within(h, 0.14, 0.86);
    const bool rim = within(x, 0.12, 0.88) && within(h, 0.12, 0.88);
    if (within(x, 0.80, 0.84) && within(h, 0.42, 0.58)) return Vec3{0.25, 0.22, 0.18};
    return panel ? colour : (rim ? colour * 0.62 : colour * 1.04);
  };
  const Vec3 cream = {0.80, 0.74, 0.60};
  const Paint doors = [=](const Vec3& p, double, double) {
    if (p[1] < 0.1) return Vec3{0.14, 0.12, 0.10};
    const bool along_x = p[2] > 1.95;
    if (along_x && within(p[0], 0.95, 1.55)) {  // the oven
      if (within(p[1], 0.72, 0.76)) return Vec3{0.80, 0.80, 0.82};
      if (p[1] > 0.80)
        return fraction((p[0] - 0.95) / 0.12) < 0.35 && p[1] > 0.82 ? Vec3{0.85, 0.85, 0.85} : Vec3{0.18, 0.18, 0.19};
      return within(p[0], 1.02, 1.48) && within(p[1], 0.25, 0.66) ? Vec3{0.06, 0.06, 0.07} : Vec3{0.55, 0.55, 0.57};
    }
    const double along = along_x ? p[0] : p[2];
    return p[1] > 0.70 ? front(along, p[1], 0.70, 0.89, 0.45, cream) : front(along, p[1], 0.1, 0.70, 0.45, cream);
  };
  const Paint stone = rough({0.14, 0.14, 0.15}, {0.44, 0.42, 0.40}, 60);
  painter.box({0.1, 0.445, 2.3}, {2.7, 0.445, 0.28}, doors, thing);
  painter.box({0.1, 0.91, 2.28}, {2.7, 0.02, 0.32}, stone, thing);
  painter.box({2.5, 0.445, 0.55}, {0.28, 0.445, 1.45}, doors, thing);
  painter.box({2.48, 0.91, 0.55}, {0.32, 0.02, 1.45}, stone, thing);
  painter.quad(
      {-0.5, 0.932, 2.1}, {0, 0, 0.36}, {0.7, 0, 0},
      [](const Vec3&, double u, double v) {
        return within(u, 0.1, 0.9) && within(v, 0.06, 0.94) ? Vec3{0.42, 0.43, 0.45} : Vec3{0.80, 0.81, 0.83};
      },
      fine);
  painter.cylinder({-0.15, 0.93, 2.5}, {-0.15, 1.2, 2.5}, 0.016, 0.014, plain({0.82, 0.83, 0.85}), fine);
  painter.cylinder({-0.15, 1.19, 2.5}, {-0.15, 1.17, 2.3}, 0.013, 0.012, plain({0.82, 0.83, 0.85}), fine);
  // Cupboards above, an extractor, the fridge.
  const Paint upper = [=](const Vec3& p, double, double) {
    return front(p[2] > 2.2 ? p[0] : p[2], p[1], 1.42, 2.2, 0.42, cream);
  };
  painter.box({-1.75, 1.81, 2.43}, {0.82, 0.39, 0.17}, upper, thing);
  painter.box({0.78, 1.81, 2.43}, {0.17, 0.39, 0.17}, upper, thing);
  painter.box({2.2, 1.81, 2.43}, {0.6, 0.39, 0.17}, upper, thing);
  painter.slab({0.96, 1.62, 2.1}, {0.6, 0, 0}, {0, 0.10, 0}, {0, 0, 0.5}, plain({0.72, 0.73, 0.75}), thing);
  painter.box({1.26, 2.05, 2.45}, {0.15, 0.4, 0.14}, plain({0.72, 0.73, 0.75}), thing);
  const Paint fridge = [](const Vec3& p, double, double) {
    if (within(p[1], 1.20, 1.22)) return Vec3{0.3, 0.3, 0.3};
    for (int i = 0; i < 6; ++i) {  // notes under magnets
      const double z = -1.55 + 0.42 * hash_fraction(i, 21), y = 1.30 + 0.40 * hash_fraction(i, 22);
      if (std::fabs(p[2] - z) < 0.05 && std::fabs(p[1] - y) < 0.06) {
        return Vec3{0.4 + 0.6 * hash_fraction(i, 23), 0.4 + 0.6 * hash_fraction(i, 24),
                    0.4 + 0.5 * hash_fraction(i, 25)};
      }
    }
    return Vec3{0.88, 0.88, 0.87};
  };
  painter.box({2.45, 0.92, -1.35}, {0.33, 0.92, 0.36}, fridge, thing);
  // On the counters: jars, a kettle, a toaster, a plant, a knife block, bottles.
  for (int i = 0; i < 5; ++i) {
    const double x = -2.2 + 0.17 * i;
    painter.cylinder(
        {x, 0.93, 2.42}, {x, 1.06 + 0.03 * (i % 3), 2.42}, 0.055, 0.055,
        [=](const Vec3& p, double, double) {
          return p[1] > 1.03 + 0.03 * (i % 3) ? Vec3{0.45, 0.28, 0.14}
                                              : mix({0.85, 0.80, 0.70}, {0.62, 0.34, 0.18}, 0.25 * i);
        },
        fine);
  }
  painter.ball({1.25, 1.04, 2.3}, {0.11, 0.10, 0.11}, plain({0.74, 0.10, 0.08}), fine);
  painter.box({2.25, 1.03, 2.35}, {0.16, 0.10, 0.09}, plain({0.70, 0.71, 0.73}), fine);
  painter.box({2.6, 1.05, 1.2}, {0.08, 0.12, 0.06}, oak, fine);
  for (int i = 0; i < 4; ++i) {
    painter.cylinder({2.6, 0.93, 0.2 + 0.13 * i}, {2.6, 1.15, 0.2 + 0.13 * i}, 0.036, 0.030,
                     plain(mix({0.10, 0.26, 0.12}, {0.46, 0.20, 0.08}, 0.33 * i)), fine);
    painter.cylinder({2.6, 1.15, 0.2 + 0.13 * i}, {2.6, 1.24, 0.2 + 0.13 * i}, 0.014, 0.014, plain({0.1, 0.1, 0.1}),
                     fine);
  }
  Texture leaves = fine;
  leaves.layers = 22;
  painter.cylinder({0.42, 0.93, 2.42}, {0.42, 1.06, 2.42}, 0.06, 0.08, plain({0.72, 0.40, 0.26}), fine);
  bush(painter, {0.42, 1.14, 2.42}, 0.14, 3, leaves);
  // The lamp over the table.
  painter.cylinder({0.1, 2.1, 0.15}, {0.1, 2.5, 0.15}, 0.006, 0.006, plain({0.1, 0.1, 0.1}), fine);
  Texture glow = thing;
  glow.emission = 0.8;
  painter.surface(frustum_surface({0.1, 1.95, 0.15}, {0.1, 2.12, 0.15}, 0.24, 0.06), plain({0.30, 0.42, 0.36}), glow);
  // What the walls leave through: the hall and the garden.
  Texture beyond;
  beyond.size = 3;
  beyond.layers = 30;
  beyond.emission = 0.5;
  painter.surface(dome_surface({0, 1, 0}, 6.5, -0.6, 0.8), rough({0.34, 0.36, 0.30}, {0.62, 0.62, 0.58}, 0.8), beyond);
  painter.floaters({0, 1.3, 0}, {2.2, 1.0, 2.2}, 700, 1.5);
}

}  // namespace vrpipe
