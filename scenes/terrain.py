"""Ridges of gradient noise (Perlin 1985; Musgrave, Kolb, Mace 1989), the same on every machine."""
import math


def lattice_angle(x, y, octave):
    """A direction for each lattice point, from its coordinates by integer mixing (Weyl's and Steele's constants)."""
    bits = (x * 0x9E3779B1 + y * 0x85EBCA77 + octave * 0xC2B2AE3D) & 0xFFFFFFFF
    bits = ((bits ^ (bits >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    bits = ((bits ^ (bits >> 12)) * 0x297A2D39) & 0xFFFFFFFF
    return 2 * math.pi * (bits ^ (bits >> 15)) / 4294967296


def gradient_noise(x, y, octave):
    i, j = math.floor(x), math.floor(y)
    fx, fy = x - i, y - j

    def slope(di, dj):
        angle = lattice_angle(i + di, j + dj, octave)
        return math.cos(angle) * (fx - di) + math.sin(angle) * (fy - dj)

    fade = lambda t: t * t * t * (t * (6 * t - 15) + 10)
    u, v = fade(fx), fade(fy)
    low = slope(0, 0) + u * (slope(1, 0) - slope(0, 0))
    high = slope(0, 1) + u * (slope(1, 1) - slope(0, 1))
    return 1.5 * (low + v * (high - low))


def ridges(x, y, octaves=9):
    """Sharp crests, and rough only where the ground is high already: valleys stay smooth."""
    height, weight, amplitude, frequency = 0.0, 1.0, 0.5, 1.0
    for octave in range(octaves):
        crest = (1 - abs(gradient_noise(x * frequency, y * frequency, octave))) ** 2
        height += amplitude * crest * weight
        weight = min(1.0, max(0.0, crest * 1.8))
        amplitude *= 0.47
        frequency *= 2.03
    return height
