// Packets over a layout's own tree with the lr-wpan module of ns-3 3.37, as a peer to measure beside.
//
//   libraries="-lns3-lr-wpan -lns3-spectrum -lns3-propagation -lns3-mobility -lns3-network -lns3-core"
//   g++ -O2 -std=c++17 lr_wpan_tree.cc -o lr_wpan_tree $libraries
//   ./lr_wpan_tree LAYOUT tree|saturated PERIOD_S DURATION_S PAYLOAD_BYTES SEED LEAST_SINR_DB as_is|mended
//
// LAYOUT is a text file: the number of motes, the loss at 1 m [dB] and the exponent of the distance,
// then x [m], y [m] and the parent (-1: the sink) of each mote.
//
// tree: the k-th packet of each mote leaves at a random time of its k-th period; 5 s to drain.
// saturated: each mote always has two packets to send. Relays forward from MCPS-DATA.indication;
// queues hold 30 frames; duplicates are known by origin and number.
//
// LEAST_SINR_DB: less than that anywhere destroys a frame, above it bits fail as in the library; -100 is the
// library as it is, and what lies between the links with and without interference is `destructive`.
//
// mended: interference also counts for a frame in reception up to where another frame ends. The library
// looks at it where a frame joins, and at the reception's own end, and so forgives what was on the air when
// the reception began and ends before it.
//
// One JSON object comes out. Its CPU times are those of building the network and of Simulator::Run.

#include <ns3/core-module.h>
#include <ns3/lr-wpan-module.h>
#include <ns3/mobility-module.h>
#include <ns3/network-module.h>
#include <ns3/propagation-module.h>
#include <ns3/spectrum-module.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <vector>

using namespace ns3;

namespace
{

double g_leastSinr = 0.0;
bool g_mended = false;

constexpr uint32_t QUEUE_FRAMES = 30;
constexpr uint32_t ACK_BYTES = 5;
constexpr double DRAIN_S = 5.0;

double
CpuSeconds()
{
    timespec spent;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
    return spent.tv_sec + 1e-9 * spent.tv_nsec;
}

struct Counts
{
    uint64_t generated = 0, delivered = 0, duplicates = 0, data = 0, acks = 0;
    uint64_t confirmed = 0, unacknowledged = 0, inaccessible = 0, overflown = 0;
    uint64_t assessed = 0, busy = 0;
    std::vector<double> delays;
};

} // namespace

// The library calls these two through the dynamic linker, which finds them here first.

void
LrWpanPhy::EndRx(Ptr<SpectrumSignalParameters> signal)
{
    using Original = void (*)(LrWpanPhy*, Ptr<SpectrumSignalParameters>);
    static const auto original = reinterpret_cast<Original>(
        dlsym(RTLD_NEXT, "_ZN3ns39LrWpanPhy5EndRxENS_3PtrINS_24SpectrumSignalParametersEEE"));
    if (g_mended)
    {
        CheckInterference();
    }
    original(this, signal);
}

double
LrWpanErrorModel::GetChunkSuccessRate(double snr, uint32_t bits) const
{
    if (bits > 0 && snr < g_leastSinr)
    {
        return 0.0;
    }
    double rate = 0.0;
    for (uint32_t k = 2; k <= 16; k++)
    {
        rate += m_binomialCoefficients[k] * std::exp(20.0 * snr * (1.0 / k - 1.0));
    }
    return std::pow(1.0 - std::min(rate * 8.0 / 15.0 / 16.0, 1.0), bits);
}

namespace
{

class Mote
{
  public:
    Mote(uint32_t id, int parent, Ptr<LrWpanNetDevice> device, uint32_t payload, Counts& counts)
        : m_id(id), m_parent(parent), m_device(device), m_payload(payload), m_counts(counts)
    {
        Ptr<LrWpanMac> mac = device->GetMac();
        mac->SetTxQMaxSize(QUEUE_FRAMES);
        mac->SetMcpsDataIndicationCallback(MakeCallback(&Mote::Indicated, this));
        mac->SetMcpsDataConfirmCallback(MakeCallback(&Mote::Confirmed, this));
        device->GetPhy()->TraceConnectWithoutContext("PhyTxBegin", MakeCallback(&Mote::Began, this));
    }

    void Periodic(double period, uint32_t packets, Ptr<UniformRandomVariable> random)
    {
        m_period = period;
        m_packets = packets;
        m_random = random;
        Next();
    }

    void Saturate()
    {
        m_saturated = true;
        // looks at each clear channel assessment before CSMA/CA does
        m_device->GetPhy()->SetPlmeCcaConfirmCallback(MakeCallback(&Mote::Assessed, this));
        Generate();
        Generate();
    }

  private:
    void Next()
    {
        if (m_number < m_packets)
        {
            const double at = m_period * (m_number + m_random->GetValue());
            Simulator::Schedule(Seconds(at) - Simulator::Now(), &Mote::Leave, this);
        }
    }

    void Leave()
    {
        Generate();
        Next();
    }

    void Generate()
    {
        std::vector<uint8_t> bytes(m_payload, 0);
        std::memcpy(bytes.data(), &m_id, 2);
        std::memcpy(bytes.data() + 2, &m_number, 4);
        m_number++;
        m_counts.generated++;
        m_left.push_back(Simulator::Now());
        Send(Create<Packet>(bytes.data(), m_payload));
    }

    void Send(Ptr<Packet> packet)
    {
        McpsDataRequestParams params;
        params.m_dstAddr = s_motes->at(m_parent).m_device->GetMac()->GetShortAddress();
        params.m_txOptions = TX_OPTION_ACK;
        m_device->GetMac()->McpsDataRequest(params, packet);
    }

    void Indicated(McpsDataIndicationParams, Ptr<Packet> packet)
    {
        uint8_t head[6];
        uint32_t origin = 0;
        uint32_t number;
        packet->CopyData(head, sizeof(head));
        std::memcpy(&origin, head, 2);
        std::memcpy(&number, head + 2, 4);
        std::vector<bool>& seen = m_seen[origin];
        if (seen.size() <= number)
        {
            seen.resize(number + 1, false);
        }
        if (seen[number])
        {
            m_counts.duplicates++;
            return;
        }
        seen[number] = true;
        if (m_parent >= 0)
        {
            Send(packet->Copy());
            return;
        }
        m_counts.delivered++;
        m_counts.delays.push_back((Simulator::Now() - s_motes->at(origin).m_left[number]).GetSeconds());
    }

    void Confirmed(McpsDataConfirmParams params)
    {
        switch (params.m_status)
        {
        case IEEE_802_15_4_SUCCESS:
            m_counts.confirmed++;
            break;
        case IEEE_802_15_4_NO_ACK:
            m_counts.unacknowledged++;
            break;
        case IEEE_802_15_4_CHANNEL_ACCESS_FAILURE:
            m_counts.inaccessible++;
            break;
        default:
            m_counts.overflown++;
        }
        if (m_saturated)
        {
            Simulator::ScheduleNow(&Mote::Generate, this);
        }
    }

    void Assessed(LrWpanPhyEnumeration status)
    {
        m_counts.assessed++;
        m_counts.busy += status == IEEE_802_15_4_PHY_BUSY;
        m_device->GetCsmaCa()->PlmeCcaConfirm(status);
    }

    void Began(Ptr<const Packet> packet)
    {
        (packet->GetSize() == ACK_BYTES ? m_counts.acks : m_counts.data)++;
    }

    uint32_t m_id;
    int m_parent;
    Ptr<LrWpanNetDevice> m_device;
    uint32_t m_payload;
    Counts& m_counts;
    uint32_t m_number = 0;
    uint32_t m_packets = 0;
    double m_period = 0.0;
    bool m_saturated = false;
    Ptr<UniformRandomVariable> m_random;
    std::vector<Time> m_left;
    std::map<uint32_t, std::vector<bool>> m_seen;

  public:
    static std::vector<Mote>* s_motes;
};

std::vector<Mote>* Mote::s_motes = nullptr;

} // namespace

int
main(int argc, char* argv[])
{
    if (argc != 9)
    {
        std::cerr << argv[0] << ": LAYOUT MODE PERIOD_S DURATION_S PAYLOAD_BYTES SEED LEAST_SINR_DB MENDED\n";
        return 2;
    }
    const bool saturated = std::string(argv[2]) == "saturated";
    const double period = std::stod(argv[3]);
    const double duration = std::stod(argv[4]);
    const uint32_t payload = std::stoul(argv[5]);
    RngSeedManager::SetSeed(1);
    RngSeedManager::SetRun(std::stoul(argv[6]) + 1);
    g_leastSinr = std::pow(10.0, std::stod(argv[7]) / 10.0);
    g_mended = std::string(argv[8]) == "mended";

    const double began = CpuSeconds();
    std::ifstream file(argv[1]);
    uint32_t n;
    double loss;
    double exponent;
    file >> n >> loss >> exponent;
    Ptr<ListPositionAllocator> places = CreateObject<ListPositionAllocator>();
    std::vector<int> parents;
    for (uint32_t i = 0; i < n; i++)
    {
        double x;
        double y;
        int parent;
        file >> x >> y >> parent;
        places->Add(Vector(x, y, 0.0));
        parents.push_back(parent);
    }
    if (!file)
    {
        std::cerr << argv[1] << ": must hold x, y and the parent of " << n << " motes\n";
        return 2;
    }
    NodeContainer nodes;
    nodes.Create(n);
    MobilityHelper mobility;
    mobility.SetMobilityModel("ns3::ConstantPositionMobilityModel");
    mobility.SetPositionAllocator(places);
    mobility.Install(nodes);
    Ptr<LogDistancePropagationLossModel> model = CreateObject<LogDistancePropagationLossModel>();
    model->SetPathLossExponent(exponent);
    model->SetReference(1.0, loss);
    Ptr<SingleModelSpectrumChannel> channel = CreateObject<SingleModelSpectrumChannel>();
    channel->AddPropagationLossModel(model);
    channel->SetPropagationDelayModel(CreateObject<ConstantSpeedPropagationDelayModel>());
    LrWpanHelper helper;
    helper.SetChannel(channel);
    NetDeviceContainer devices = helper.Install(nodes);
    helper.AssociateToPan(devices, 0);
    helper.AssignStreams(devices, 0);

    Counts counts;
    std::vector<Mote> motes;
    motes.reserve(n);
    Mote::s_motes = &motes;
    Ptr<UniformRandomVariable> random = CreateObject<UniformRandomVariable>();
    random->SetStream(1000000);
    for (uint32_t i = 0; i < n; i++)
    {
        motes.emplace_back(i, parents[i], DynamicCast<LrWpanNetDevice>(devices.Get(i)), payload, counts);
        if (parents[i] < 0)
        {
            continue;
        }
        if (saturated)
        {
            Simulator::Schedule(MicroSeconds(random->GetInteger(0, 10000)), &Mote::Saturate, &motes[i]);
        }
        else
        {
            motes[i].Periodic(period, std::lround(duration / period), random);
        }
    }
    Simulator::Stop(Seconds(saturated ? duration : duration + DRAIN_S));
    const double built = CpuSeconds();
    Simulator::Run();
    const double ran = CpuSeconds();

    std::vector<double>& delays = counts.delays;
    std::sort(delays.begin(), delays.end());
    double sum = 0.0;
    for (double delay : delays)
    {
        sum += delay;
    }
    const size_t m = delays.size();
    std::cout.precision(12);
    std::cout << "{\"generated\": " << counts.generated << ", \"delivered\": " << counts.delivered
              << ", \"delay_mean_s\": " << (m ? sum / m : 0.0) << ", \"delay_p95_s\": "
              << (m ? delays[static_cast<size_t>(0.95 * (m - 1))] : 0.0)
              << ", \"data_frames\": " << counts.data << ", \"ack_frames\": " << counts.acks
              << ", \"duplicates\": " << counts.duplicates << ", \"confirmed\": " << counts.confirmed
              << ", \"no_ack\": " << counts.unacknowledged << ", \"no_channel\": " << counts.inaccessible
              << ", \"queue_full\": " << counts.overflown << ", \"assessed\": " << counts.assessed
              << ", \"found_busy\": " << counts.busy << ", \"events\": " << Simulator::GetEventCount()
              << ", \"startup_cpu_s\": " << built - began << ", \"loop_cpu_s\": " << ran - built << "}\n";
    Simulator::Destroy();
    return 0;
}
