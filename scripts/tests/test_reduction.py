"""The reduction of batches, compared with loops and with cases computed by hand."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_reference as ref


def noisy_batches(batches: int = 5, height: int = 16, width: int = 24) -> NDArray[np.float32]:
    """Batches with noise everywhere, except in a constant block (the top left tile) and a black block (a part of the next)."""
    noise = np.random.default_rng(7).lognormal(0.0, 0.3, (batches, height, width, 3)).astype(np.float32)
    noise[:, :8, :8] = (0.3, 0.2, 0.1)
    noise[:, :3, 8:13] = 0.0
    return noise


def test_tiles_equal_a_loop_over_pixels() -> None:
    images = noisy_batches()
    found = ref.reduce_batches(images)
    assert found.tiles.shape == (5, 2, 3, 3)
    for k, row, column, channel in np.ndindex(found.tiles.shape):
        values = [
            float(images[k, y, x, channel])
            for y in range(8 * row, 8 * row + 8)
            for x in range(8 * column, 8 * column + 8)
            if not found.deterministic[y, x]
        ]
        if values:
            assert found.tiles[k, row, column, channel] == pytest.approx(math.fsum(values) / len(values), rel=1e-12)
        else:
            assert (row, column) == (0, 0)
            assert math.isnan(found.tiles[k, row, column, channel])


def test_mean_and_standard_error_equal_the_textbook() -> None:
    images = noisy_batches()
    found = ref.reduce_batches(images)
    values = [float(v) for v in images[:, 9, 11, 1]]
    mean = math.fsum(values) / 5
    error = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / 4 / 5)
    assert found.mean[9, 11, 1] == pytest.approx(mean, rel=1e-12)
    assert found.standard_error[9, 11, 1] == pytest.approx(error, rel=1e-12)


def test_deterministic_means_constant_or_black_away_from_noise() -> None:
    """The constant tile is deterministic as a whole. The black block is not deterministic where it touches noise in its tile."""
    images = noisy_batches()
    expected = np.zeros((16, 24), dtype=bool)
    expected[:8, :8] = True
    expected[:2, 8:12] = True
    assert np.array_equal(ref.reduce_batches(images).deterministic, expected)


def test_one_noisy_channel_is_enough() -> None:
    images = np.full((4, 16, 8, 3), 0.5, dtype=np.float32)
    images[:, 12, 3, 2] = (0.0, 0.0, 1e-6, 0.0)
    expected = np.ones((16, 8), dtype=bool)
    expected[11:14, 2:5] = False
    assert np.array_equal(ref.reduce_batches(images).deterministic, expected)


def test_deterministic_pixels_equal_a_loop() -> None:
    steady = np.random.default_rng(3).random((24, 16)) > 0.08
    found = ref.deterministic_pixels(steady)
    for y, x in np.ndindex(steady.shape):
        near = [
            steady[j, i]
            for j in range(max(y - 1, y // 8 * 8), min(y + 2, y // 8 * 8 + 8))
            for i in range(max(x - 1, x // 8 * 8), min(x + 2, x // 8 * 8 + 8))
        ]
        assert found[y, x] == all(near)
    assert 0 < found.sum() < steady.sum()


@pytest.mark.parametrize(("deviation", "expected"), [(0.9e-4, True), (1.1e-4, False)])
def test_deterministic_threshold_is_on_the_deviation_of_one_batch(deviation: float, expected: bool) -> None:
    # K batches, half of them 1 - d and half of them 1 + d, have the standard deviation d sqrt(K / (K - 1)).
    batches = 16
    d = deviation / math.sqrt(batches / (batches - 1))
    images = np.ones((batches, 8, 8, 3)) + d * np.where(np.arange(batches) % 2, 1.0, -1.0)[:, None, None, None]
    mask = ref.reduce_batches(images.astype(np.float32)).deterministic
    assert mask.all() == expected
    assert mask.any() == expected


def test_one_batch_is_refused() -> None:
    with pytest.raises(ref.UserError, match="at least two"):
        ref.reduce_batches(np.ones((1, 8, 8, 3), dtype=np.float32))


def test_summary_finds_a_known_scatter() -> None:
    rng = np.random.default_rng(11)
    images = (1.0 + 0.1 * rng.standard_normal((400, 16, 16, 3))).astype(np.float32)
    found = ref.summary(images, ref.reduce_batches(images))
    assert found["global_relative_se"] == pytest.approx([0.1 / 16 / 20] * 3, rel=0.15)
    assert found["tile_relative_se_median"] == pytest.approx(0.1 / 8 / 20, rel=0.15)
    assert abs(found["tile_excess_kurtosis_median"]) < 0.5
    assert found["deterministic_fraction"] == 0.0


def test_summary_of_a_constant_image_has_no_tiles_to_judge() -> None:
    images = np.full((4, 8, 8, 3), 0.25, dtype=np.float32)
    found = ref.summary(images, ref.reduce_batches(images))
    assert found["tile_relative_se_p95"] == 0.0
    assert found["deterministic_fraction"] == 1.0


def test_seeds_never_collide() -> None:
    names = [path.stem for path in ref.all_scenes()] + ["tiny", "a", "b"]
    assert len(names) > 3
    ranges = sorted((ref.batch_seed(name, 0), ref.batch_seed(name, ref.MAX_BATCHES - 1)) for name in names)
    for (first, last), (following, _) in zip(ranges, [*ranges[1:], (2**32, 0)], strict=True):
        assert first + ref.MAX_BATCHES - 1 == last < following
    # Scenes use whole blocks of seeds, and two blocks are either the same or disjoint.
    assert all(first % ref.MAX_BATCHES == 0 for first, _ in ranges)
    assert len({ref.batch_seed("a", k) for k in range(ref.MAX_BATCHES)}) == ref.MAX_BATCHES


@pytest.mark.parametrize("batch", [-1, ref.MAX_BATCHES])
def test_seed_outside_the_range_is_refused(batch: int) -> None:
    with pytest.raises(ref.UserError, match="outside"):
        ref.batch_seed("a", batch)
