from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.net.fragmentation import Reassembler, fragment, fragment_count, parse_fragment
from wsnsim.net.mac.frames import MacData, decode_frame
from wsnsim.net.mesh import MeshHeader, decode_mesh

SIZES = st.one_of(st.integers(0, 400), st.integers(2030, 2070), st.integers(0, 20_000))


@settings(max_examples=150, deadline=None)
@given(
    size=SIZES, first=st.integers(0, 255), tag=st.integers(0, 0xFFFF), room=st.sampled_from((110, 111, 116)),
    rng=st.randoms(use_true_random=False),
)  # fmt: skip
def test_any_datagram_comes_back_from_its_fragments_in_any_order(size, first, tag, room, rng):
    data = (bytes([first]) + rng.randbytes(size))[:size]
    packets = fragment(data, tag, room)
    assert all(len(packet) <= room for packet in packets)
    if packets == [data]:
        assert parse_fragment(data) is None
        return
    pieces = [parse_fragment(packet) for packet in packets]
    assert all(piece is not None and piece.offset % 8 == 0 for piece in pieces)
    assert [piece.encode() for piece in pieces] == packets
    rng.shuffle(pieces)
    repeated = [p for piece in pieces for p in [piece] * rng.randint(1, 2)]
    reassembler, key, wholes = Reassembler(), (1, size, tag), []
    while repeated:
        whole = reassembler.add(key, repeated.pop(0))
        if whole is not None:
            wholes.append(whole)
            break
    assert wholes == [data]
    assert all(piece is pieces[-1] for piece in repeated)


@settings(max_examples=100, deadline=None)
@given(size=SIZES, room=st.sampled_from((110, 111, 116)))
def test_the_number_of_fragments_is_known_beforehand(size, room):
    assert fragment_count(size, room) == len(fragment(bytes(size), 0, room))


@given(
    sequence=st.integers(0, 255), addresses=st.lists(st.integers(0, 0xFFFF), min_size=5, max_size=5),
    hops=st.integers(1, 255), body=st.binary(max_size=110), ack=st.booleans(),
)  # fmt: skip
def test_headers_round_trip(sequence, addresses, hops, body, ack):
    pan, to, by, origin, final = addresses
    header = MeshHeader(hops, origin, final)
    frame = MacData(sequence, pan, to, by, header.encode() + body, ack)
    back = decode_frame(frame.encode())
    assert back == frame
    assert decode_mesh(back.payload) == (header, body)
