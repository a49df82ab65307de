"""The fast engine below the layers: edges in blocks of centres that fit the cache."""

__all__: list[str] = []
