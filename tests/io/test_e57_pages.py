"""Pages of E57 files and their checksums, against the definition of CRC-32C."""

import numpy as np

from tribrach.io.e57_pages import PAGE, PAYLOAD, paged


def bit_by_bit(content: bytes) -> int:
    """CRC-32C as RFC 3720 defines it, one bit after the other."""
    crc = 0xFFFFFFFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def test_the_definition_gives_the_published_sums() -> None:
    """RFC 3720, appendix B.4."""
    assert bit_by_bit(bytes(32)) == 0x8A9136AA
    assert bit_by_bit(b"\xff" * 32) == 0x62A8AB43
    assert bit_by_bit(bytes(range(32))) == 0x46DD794E


def test_pages_have_the_checksums_of_the_definition() -> None:
    content = np.random.default_rng(3).bytes(5 * PAYLOAD)
    pages = paged(content)
    for k in range(5):
        stated = int.from_bytes(pages[k * PAGE + PAYLOAD : (k + 1) * PAGE], "big")
        assert stated == bit_by_bit(content[k * PAYLOAD : (k + 1) * PAYLOAD])
