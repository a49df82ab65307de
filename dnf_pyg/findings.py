"""What makes the result of denoising less reliable, in sentences."""

__all__ = ["findings"]


def findings(
    noise_level: float,
    noise_range: tuple[float, float] | None,
    left_alone: float = 0.0,
    num_turned: int = 0,
    num_doubled: int = 0,
    num_flipped: int = 0,
) -> list[str]:
    """Say what a user should know about a denoised mesh.

    Args:
        noise_level: Estimated noise level, mean edge lengths.
        noise_range: Noise levels that the weights were trained on, if known.
        left_alone: Share of the mesh that stays in place since the noise does not explain what would change there.
        num_turned: Faces that are wound the other way than their neighbours.
        num_doubled: Faces that have the same vertices as another.
        num_flipped: Faces of the result more than 90 degrees from their filtered normal.

    Returns:
        One text for each finding; none if all is well.

    Example:
        >>> findings(0.2, (0.03, 0.45), num_flipped=2)
        ['Faces that remain flipped because the input is folded there: 2.']
    """
    lowest, highest = noise_range or (0.0, float("inf"))
    found = {
        f"The noise level of about {noise_level:.3f} mean edge lengths is below {lowest}, the lowest that the weights "
        "were trained on: fine detail may be smoothed away. A lower strength keeps it.": noise_level < lowest
        and left_alone < 1,
        f"The noise level of about {noise_level:.2f} mean edge lengths is above {highest}, the highest that the "
        "weights were trained on. Use two passes, or train on such noise.": noise_level > highest,
        f"{left_alone:.0%} of the mesh stays as it is: the noise there is too weak to tell from the shape, or too weak "
        "to explain what the filter would change. Set max_excess to infinity to move all of it.": left_alone > 0.005,
        f"Faces that are wound the other way than their neighbours: {num_turned:,}. They are treated as if they were "
        "turned; the file keeps their winding.": num_turned > 0,
        f"Faces that lie on another of the same vertices, as in double-sided meshes: {num_doubled:,}. Each counts as "
        "one with the other.": num_doubled > 0,
        f"Faces that remain flipped because the input is folded there: {num_flipped}.": num_flipped > 0,
    }
    return [text for text, applies in found.items() if applies]
